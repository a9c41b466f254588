"""Visit waypoints one after another, as many as time allows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from fulmar_core.counter_rng import Draws
from fulmar_core.tasks.waypoint_tasks import PassingTask, path_terms
from fulmar_core.tasks.waypoints import Course


@dataclass(frozen=True, kw_only=True)
class GoThroughPositions(PassingTask):
    """Pass through positions of a random course in their order.

    Three of them are seen, one more than in RoboRAN: where a boat leaves a waypoint to depends on the next two.
    """

    kind: Literal["go_through_positions"]
    course: Course

    seen: ClassVar[int] = 3
    observation_names: ClassVar[tuple[str, ...]] = path_terms(3, heading=False)

    def places(self, draws: Draws) -> np.ndarray:
        """Draw where the targets are, shape (worlds, k, 2) [m]."""
        return self.course.draw(draws)
