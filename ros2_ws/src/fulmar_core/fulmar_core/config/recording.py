"""How much of a run a recorder keeps, and in how many files."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Mode = Literal["whole", "ring", "goals"]
MODES: tuple[str, ...] = ("whole", "ring", "goals")
FrameForm = Literal["compressed", "raw"]
FRAME_FORMS: tuple[str, ...] = ("compressed", "raw")


@dataclass(frozen=True)
class Recording:
    """The section `recorder:` of a system file, and the parameters of the recorder node."""

    mode: Mode = "whole"  # everything; only what was around a fault; a bag for each goal
    before_fault_s: float = 30.0  # ring: kept in memory and written when a fault shows [s]
    after_fault_s: float = 5.0  # ring: written after the last sign of a fault [s]
    split_mb: float = 1000.0  # a file that has grown to this is followed by a new one; 0: never [1e6 bytes]
    split_s: float = 3600.0  # so is one that was begun so long ago; 0: never [s]
    # Images of cameras: as JPEG and PNG, or as they come, which takes 20 times as much room.
    frames: FrameForm = "compressed"

    def __post_init__(self) -> None:
        if self.mode not in MODES:
            raise ValueError(f"mode = '{self.mode}' must be one of {', '.join(MODES)}.")
        if self.frames not in FRAME_FORMS:
            raise ValueError(f"frames = '{self.frames}' must be one of {', '.join(FRAME_FORMS)}.")
        if not 0.0 < self.before_fault_s < float("inf"):
            raise ValueError(f"before_fault_s = {self.before_fault_s:g} must be greater than 0 and finite.")
        for name in ("after_fault_s", "split_mb", "split_s"):
            if not 0.0 <= getattr(self, name) < float("inf"):
                raise ValueError(f"{name} = {getattr(self, name):g} must be 0 or more and finite.")
