"""Visit waypoints one after another, each with its heading, as many as time allows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from fulmar_core.counter_rng import Draws
from fulmar_core.tasks.passing_poses import PosePassingTask
from fulmar_core.tasks.waypoints import Course


@dataclass(frozen=True, kw_only=True)
class GoThroughPoses(PosePassingTask):
    """Pass through poses of a random course in their order; each looks from the one before to the one after."""

    kind: Literal["go_through_poses"]
    course: Course

    def places(self, draws: Draws) -> np.ndarray:
        """Draw where the targets are, shape (worlds, k, 2) [m]."""
        return self.course.draw(draws)
