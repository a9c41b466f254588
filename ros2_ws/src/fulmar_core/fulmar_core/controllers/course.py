"""Controllers that want to know the whole course are told before each step, on ROS and in evaluation."""

from __future__ import annotations

from dataclasses import replace
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from fulmar_core.controllers.controller import Controller
from fulmar_core.goal import Goal

_AT_ONCE = 2  # targets that may be passed in one control step; who says more has lost count


@runtime_checkable
class Farsighted(Protocol):
    """A controller that looks beyond the targets that are observed; `Controller` itself does not ask for it."""

    def hear_course(self, places: np.ndarray) -> None:
        """Hear where all targets are, in their order, right before `act`; after the last one the first comes again.

        Args:
            places: Shape (..., k, 2) [m]; at tasks that track velocities, the two velocities of each target [m/s].
        """
        ...


@runtime_checkable
class Navigator(Protocol):
    """A controller that knows how far it has come; it may know its place better than one reading."""

    def coming(self, places: np.ndarray) -> np.ndarray | None:
        """Say which target comes next.

        Args:
            places: As of `Farsighted.hear_course`.

        Returns:
            Numbers of targets in the course, shape (...,); None where it is on no such course.
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


def progressed(controller: Controller, goal: Goal) -> Goal:
    """The goal as far as a controller knows to have come, which is never less than is known already.

    It is asked at each step. Many targets at once are not believed: on a course that passes the same places again, who
    has just begun cannot tell the rounds apart.

    Args:
        controller: Any.
        goal: What it was told last, after `act`.
    """
    if not isinstance(controller, Navigator):
        return goal
    places = np.asarray(goal.targets)[..., :2]
    coming = controller.coming(places)
    if coming is None:
        return goal
    done = np.asarray(goal.done)
    ahead = further(coming, done, places.shape[-2])
    return replace(goal, done=done + np.where(ahead <= _AT_ONCE, ahead, 0).astype(done.dtype))


def further(coming: ArrayLike, known: ArrayLike, count: int) -> np.ndarray:
    """How many targets one count is ahead of another; 0 where it is behind.

    Args:
        coming: Number of the target that comes next, shape (...,).
        known: The same by the other count, or how many are done, shape (...,).
        count: Targets of the course; half a round or more ahead is taken for behind.

    Returns:
        Targets, shape (...,).
    """
    ahead = (np.asarray(coming) - np.asarray(known)) % count
    return np.where(ahead < count / 2, ahead, 0)
