"""Which profile of torques the controller `excite` plays on a satellite: goal files of the kind `torques`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from fulmar_core.config.errors import did_you_mean
from fulmar_core.states.spatial import SpatialState
from fulmar_core.tasks.torque_profiles import OWN, PROFILES


@dataclass(frozen=True)
class Torques:
    """Torques of reaction wheels over time, whatever the attitude: commands, which no node publishes as goals."""

    kind: Literal["torques"] = "torques"
    title: str = "our own profile, that shows a satellite's inertia"
    profile: str = OWN  # one of `tasks.torque_profiles.PROFILES`
    seed: int = 0  # of the pseudorandom binary sequence
    saturate: bool = False  # whether wheels may reach their limits, as in the study

    def __post_init__(self) -> None:
        if self.profile not in PROFILES:
            raise ValueError(
                f"'profile' = '{self.profile}' is not known. Known: {', '.join(PROFILES)}."
                f"{did_you_mean(self.profile, PROFILES)}"
            )
        if self.seed < 0:
            raise ValueError(f"'seed' = {self.seed} must not be negative.")

    @property
    def form(self) -> type[SpatialState]:
        """State type of satellites."""
        return SpatialState
