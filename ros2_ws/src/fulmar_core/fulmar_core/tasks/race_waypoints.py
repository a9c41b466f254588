"""Drive a race track corner by corner, as many as time allows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from fulmar_core.counter_rng import Draws
from fulmar_core.tasks.race_track import RaceTrack
from fulmar_core.tasks.waypoint_tasks import PassingTask


@dataclass(frozen=True, kw_only=True)
class RaceWaypoints(PassingTask):
    """Pass through the corners of a race track in their order."""

    kind: Literal["race_waypoints"]
    track: RaceTrack

    def places(self, draws: Draws) -> np.ndarray:
        """Draw where the targets are, shape (worlds, k, 2) [m]."""
        return self.track.draw(draws)
