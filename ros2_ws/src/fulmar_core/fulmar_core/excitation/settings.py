"""Which profile the controller `excite` plays on a satellite."""

from __future__ import annotations

from dataclasses import dataclass

from fulmar_core.errors import did_you_mean
from fulmar_core.excitation.profiles import OWN, PROFILES


@dataclass(frozen=True)
class WheelExcitation:
    """One file `configs/controllers/<robot>_excite.yaml`; without one our own profile is played."""

    profile: str = OWN  # one of `excitation.profiles.PROFILES`
    seed: int = 0  # of the pseudorandom binary sequence
    saturate: bool = False  # whether wheels may reach their limits, as in the study

    def __post_init__(self) -> None:
        if self.profile not in PROFILES:
            raise ValueError(
                f"'profile' = '{self.profile}' is not known. Known: {', '.join(PROFILES)}."
                f"{did_you_mean(self.profile, PROFILES)}"
            )
