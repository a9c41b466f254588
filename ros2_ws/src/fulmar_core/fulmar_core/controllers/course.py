"""Controllers that want to know the whole course are told before each step, on ROS and in evaluation."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

import numpy as np

from fulmar_core.controllers.controller import Controller
from fulmar_core.goal import Goal


@runtime_checkable
class Farsighted(Protocol):
    """A controller that looks beyond the targets that are observed; `Controller` itself does not ask for it."""

    def hear_course(self, places: np.ndarray) -> None:
        """Hear where all targets are, in their order, right before `act`; after the last one the first comes again.

        Args:
            places: Shape (..., k, 2) [m]; at tasks that track velocities, the two velocities of each target [m/s].
        """
        ...


def tell_course(controller: Controller, goal: Goal) -> None:
    """Tell a controller that wants to know where all targets are.

    Args:
        controller: Any.
        goal: Of the same leading shape as the observation that follows.
    """
    if isinstance(controller, Farsighted):
        controller.hear_course(np.asarray(goal.targets)[..., :2])
