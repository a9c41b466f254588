"""Wrenches that a robot's actuators can make: rank, limits along each axis and outlines, by linear programmes.

On/off valves count with their mean over time, so that every share of an opening is allowed. With a common pressure line
the shares add up to 1 at most, since n open valves give 1/n each; without one each goes up to 1 by itself.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fulmar_core.config.errors import ConfigError
from fulmar_core.dynamics.hover import hover_command
from fulmar_core.robots.robot import Robot

AXES = ("force_x", "force_y", "force_z", "torque_x", "torque_y", "torque_z")
LEAST_SHARE = 1e-6  # of the largest force or torque: what is less is rounding [-]
DIRECTIONS = 180  # in which outlines are looked for corners


@dataclass(frozen=True, eq=False)
class WrenchSet:
    """Wrenches W u of all commands u, least ≤ u ≤ 1, where Σu ≤ 1 with a common pressure line.

    Attributes:
        axes: Names out of `AXES`, one for each row of W.
        columns: W, wrench of each actuator at full command about the body's origin, shape (axes, n) [N, N·m].
        least: Smallest command, a share of the full one, shape (n,) [-].
        shared: Whether the actuators have a common pressure line.
    """

    axes: tuple[str, ...]
    columns: np.ndarray
    least: np.ndarray
    shared: bool

    @functools.cached_property
    def scale(self) -> np.ndarray:
        """Largest force of one actuator for each force, largest torque for each torque, shape (axes,) [N, N·m]."""
        sizes = np.abs(self.columns).max(axis=1)
        forces = np.array([axis.startswith("force") for axis in self.axes])
        most = np.where(forces, sizes[forces].max(initial=0.0), sizes[~forces].max(initial=0.0))
        return np.where(most > 1e-12, most, 1.0)

    @functools.cached_property
    def rank(self) -> int:
        """Of W: how many axes can be chosen at will, the size of the commands left aside."""
        return int(np.linalg.matrix_rank(self.columns / self.scale[:, None], tol=LEAST_SHARE))

    @functools.cached_property
    def missing_axes(self) -> tuple[str, ...]:
        """Axes along which no command acts alone, whatever its size and sign."""
        left, sizes, _ = np.linalg.svd(self.columns / self.scale[:, None])
        able = left[:, : int(np.sum(sizes > LEAST_SHARE))]
        outside = np.eye(len(self.axes)) - able @ able.T
        return tuple(
            axis for axis, part in zip(self.axes, outside.T, strict=True) if np.abs(part).max() > LEAST_SHARE
        )

    def without_shared_line(self) -> WrenchSet:
        """The same actuators, each with a supply of its own."""
        return dataclasses.replace(self, shared=False)

    def about(self, place: Sequence[float]) -> WrenchSet:
        """The same wrenches about another point of the body.

        Args:
            place: In the body's frame, x, y, z [m].
        """
        if all(part == 0.0 for part in place):
            return self
        rows = [AXES.index(axis) for axis in self.axes]
        full = np.zeros((6, self.columns.shape[1]))
        full[rows] = self.columns
        full[3:] -= np.cross(np.asarray(place), full[:3].T).T
        return dataclasses.replace(self, columns=full[rows])

    def most_along(self, direction: np.ndarray, *, free: Sequence[int] = ()) -> float:
        """How far the wrenches reach along a direction.

        Args:
            direction: Shape (axes,) [N, N·m].
            free: Axes whose part of the wrench may have any value; that of all others is the direction's.

        Returns:
            Largest r for which r · direction is among them, the free axes left aside; 0 where nothing is [-].
        """
        fixed = [i for i in range(len(self.axes)) if i not in free]
        found = self._best(
            np.append(np.zeros(len(self.least)), -1.0),
            (self.columns[fixed] / self.scale[fixed, None], -(direction / self.scale)[fixed, None]),
        )
        return 0.0 if found is None else max(0.0, float(found[-1]))

    @functools.cached_property
    def limits(self) -> np.ndarray:
        """Largest pure force or torque along each axis, the other axes zero, shape (axes, 2): less and more than 0."""
        reach = [[-self.most_along(-way), self.most_along(way)] for way in np.diag(self.scale)]
        found = np.array(reach) * self.scale[:, None]
        return np.where(np.abs(found) > LEAST_SHARE * self.scale[:, None], found, 0.0)

    @functools.cached_property
    def holds_zero_with_all_on(self) -> bool:
        """Whether no wrench remains while every actuator that pushes one way is on.

        With full rank this is what lets one-way actuators push every way (Davis, "Theory of positive linear
        dependence", Amer. J. Math. 76, 1954, theorem 3.3).
        """
        if (self.least < 0.0).all():
            return True
        # The common least share as the last variable: u_i ≥ t.
        count = len(self.least)
        at_least = np.hstack((-np.eye(count), np.ones((count, 1))))
        found = self._best(
            np.append(np.zeros(count), -1.0),
            (self.columns / self.scale[:, None], np.zeros((len(self.axes), 1))),
            (at_least, np.zeros(count)),
        )
        return found is not None and float(found[-1]) > LEAST_SHARE

    def outline(self, first: int, second: int, *, pure: bool) -> np.ndarray:
        """Corners of what can be made along two axes, in order, shape (corners, 2) [N, N·m].

        Args:
            first: Number of the axis to the right.
            second: Number of the axis upwards.
            pure: Whether the other axes stay zero; else they have any value.
        """
        chosen, others = [first, second], [i for i in range(len(self.axes)) if i not in (first, second)]
        rows = self.columns / self.scale[:, None]
        equal = (rows[others] if pure else rows[:0], np.zeros((len(others) if pure else 0, 1)))
        corners = []
        for angle in (
            np.arange(DIRECTIONS) * 2.0 * np.pi / DIRECTIONS + 1e-3
        ):  # past the axes: one corner each
            aim = np.array([np.cos(angle), np.sin(angle)]) @ rows[chosen]
            found = self._best(np.append(-aim, 0.0), equal)
            assert found is not None  # no command at all is among them
            corners.append(self.columns[chosen] @ found[:-1])
        return _distinct(np.array(corners), self.scale[chosen])

    def _best(
        self,
        cost: np.ndarray,
        equal: tuple[np.ndarray, np.ndarray],
        at_most: tuple[np.ndarray, np.ndarray] | None = None,
    ) -> np.ndarray | None:
        """Commands and one more variable, from 0 to any size, of the least cost; None where there are none.

        Args:
            cost: Shape (n + 1,).
            equal: Rows for the commands and for the variable, whose sums are 0.
            at_most: Rows over all, and what they are at most.
        """
        # At import this would cost every node most of a second.
        from scipy.optimize import linprog

        count = len(self.least)
        rows, most = at_most if at_most is not None else (np.zeros((0, count + 1)), np.zeros(0))
        if self.shared:
            rows, most = np.vstack((rows, np.append(np.ones(count), 0.0))), np.append(most, 1.0)
        both = np.hstack(equal)
        found = linprog(
            cost,
            A_ub=rows if len(rows) else None,
            b_ub=most if len(most) else None,
            A_eq=both if len(both) else None,
            b_eq=np.zeros(len(both)) if len(both) else None,
            bounds=[(float(low), 1.0) for low in self.least] + [(0.0, None)],
            method="highs",
        )
        return None if found.x is None else np.asarray(found.x)


def wrench_set_of(robot: Robot) -> WrenchSet:
    """Wrenches of a robot's actuators about its origin, along the axes in which it moves.

    Of one that they carry those beyond what does, with commands as shares of what that leaves.

    Raises:
        ConfigError: The forces of its family are not those of single actuators, or do not carry it.
    """
    actuators, axes = robot.actuators, list(robot.kind.axes)
    if actuators.full_wrenches is None:
        raise ConfigError(
            f"'{robot.name}' has {actuators.kind}, whose forces are not those of single actuators."
        )
    wrenches, least, shared = actuators.full_wrenches
    if robot.kind.lifted:
        hover = hover_command(robot) / actuators.scale
        wrenches, least = wrenches * (1.0 - hover)[:, None], (least - hover) / (1.0 - hover)
    return WrenchSet(tuple(AXES[i] for i in axes), wrenches[:, axes].T, least, shared)


def _distinct(corners: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """Corners without those that repeat the one before."""
    moved = np.abs((corners - np.roll(corners, 1, axis=0)) / scale).max(axis=1) > LEAST_SHARE
    return corners[moved] if moved.any() else corners[:1]
