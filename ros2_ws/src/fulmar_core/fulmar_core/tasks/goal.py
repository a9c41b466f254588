"""Goal of an episode: targets in their order, obstacles, and things of the task."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from fulmar_core.states.arrays import array_namespace
from fulmar_core.states.planar import PlanarState
from fulmar_core.states.rotation import Array

PLACES = ("goal_pose", "goal_point")  # topics of goals that are one place
PoseTuple = tuple[float, ...]  # as people write a pose: `State.NUMBERS` [m, deg]


@dataclass(frozen=True, slots=True)
class Goal:
    """Targets of one episode, or of many at once.

    A target in the plane is a pose (x [m], y [m], yaw [rad]) in the world, or, for tasks that track velocities, a
    velocity (ahead [m/s], to the left [m/s], turn rate [rad/s]) in the body's frame. In space it has seven numbers,
    place [m] and unit quaternion x, y, z, w, or six, velocity [m/s] and turn rate [rad/s] along the body's axes.
    """

    targets: Array  # (..., k, 3; 7 or 6 in space), k >= 1; after the last one the first comes again
    done: Array  # (...,) targets already reached, whole numbers
    # (..., m, 3 or more) x [m], y [m], radius [m] of discs, and what a task adds to them; m may be 0, a radius of 0 is
    # no obstacle.
    obstacles: Array
    # Poses (..., 3) x [m], y [m], yaw [rad], in space (..., 7), in the world by name: of what `Task.things` declares,
    # and of whatever else a task keeps from step to step.
    things: Mapping[str, Array] = field(default_factory=dict)

    def write(self, index: Any, other: Goal) -> None:
        """Overwrite some worlds of a batch in place."""
        for mine, theirs in zip(self.arrays(), other.arrays(), strict=True):
            mine[index] = theirs

    def __getitem__(self, index: Any) -> Goal:
        """Pick worlds out of a batch."""
        return self.mapped(lambda array: array[index])

    def arrays(self) -> tuple[Array, ...]:
        """Every array, things last."""
        return (self.targets, self.done, self.obstacles, *self.things.values())

    def mapped(self, change: Callable[[Array], Array]) -> Goal:
        """The goal with every array changed, in the order of `arrays`."""
        targets, done, obstacles = change(self.targets), change(self.done), change(self.obstacles)
        return Goal(targets, done, obstacles, {name: change(pose) for name, pose in self.things.items()})

    def among(self, things: Mapping[str, Array]) -> Goal:
        """The goal with some things where they are now."""
        return replace(self, things={**self.things, **things}) if things else self

    @property
    def current(self) -> Array:
        """Target that counts now, shape (..., 3)."""
        return self.ahead(0)

    def ahead(self, further: int) -> Array:
        """The target that comes `further` after the current one (0), shape (..., 3)."""
        count = self.targets.shape[-2]
        if count == 1:
            return self.targets[..., 0, :]
        xp = array_namespace(self.targets)
        which = xp.astype((self.done + further) % count, xp.int64)
        if which.ndim == 0:
            return self.targets[int(which)]
        if which.ndim == 1:
            return self.targets[xp.arange(which.shape[0]), which]
        return xp.take_along_axis(self.targets, which[..., None, None], axis=-2)[..., 0, :]


def no_obstacles(worlds: int, count: int = 0) -> np.ndarray:
    """Obstacles of worlds that have none, shape (worlds, count, 3)."""
    return np.zeros((worlds, count, 3))


def goal_at(*targets: Sequence[float], obstacles: np.ndarray | None = None) -> Goal:
    """A goal without a batch axis.

    Args:
        targets: Poses (x [m], y [m], yaw [rad]) or body velocities, at least one.
        obstacles: Discs, shape (m, 3); none by default.
    """
    return Goal(
        np.array(targets, dtype=float),
        np.asarray(0.0),
        np.zeros((0, 3)) if obstacles is None else np.asarray(obstacles, dtype=float),
    )


def goals_at(targets: Array) -> Goal:
    """A batch of goals with one target each.

    Args:
        targets: Poses or body velocities as in `Goal`, shape (n, 3).
    """
    zero = array_namespace(targets).zeros_like(targets[:, 0])
    return Goal(targets[:, None, :], zero, no_obstacles(len(targets)))


def stack_goals(goals: list[Goal]) -> Goal:
    """Join single goals into a batch along a new first axis."""
    stacked = map(np.stack, zip(*(goal.arrays() for goal in goals), strict=True))
    return goals[0].mapped(lambda _: next(stacked))


def goal_in_float64(goal: Goal) -> Goal:
    """The same goal as NumPy arrays of float64."""
    return goal.mapped(lambda array: np.asarray(array, dtype=float))


def offset_to(state: PlanarState, target: Array) -> tuple[Array, Array]:
    """Vector from a body to a target in the world, shapes (...,) [m]."""
    return target[..., 0] - state.x, target[..., 1] - state.y
