"""Looks for quick drives of courses: ways that a controller can be brought to go (`beam`), then optimal control.

Optimal control alone ends at the quickest drive near its guess, and another way around a waypoint is another valley.
So it begins from the quickest ways that rehearsals find.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from policy_server.planning.beam import Beam, Way
from policy_server.planning.program import Drive
from policy_server.planning.settings import PlannerSettings

_SHORTEST_S = 0.06  # of a leg in a guess [s]
_STRIDE = 3  # legs; plans have, and keep, a multiple of it, so that few programs do for all
_NEARER = 0.9  # factor on how near a waypoint is passed that a boat would miss
_BEYOND = 2  # waypoints after the horizon that matter too, without which the last ones would be greedy


def lengths(legs: int) -> range:
    """Legs of the drives that are made quick, for plans of at most so many."""
    return range(_STRIDE, whole(legs) + 1, _STRIDE)


def whole(legs: int) -> int:
    """So many legs or some more, with which a plan may end."""
    return -(-legs // _STRIDE) * _STRIDE


@dataclass(frozen=True)
class Order:
    """What a plan is asked for."""

    start: np.ndarray  # state that it begins in, shape (size,), as of `boat`
    # Of the waypoints from the next one on, shape (k, 2); after the last the first comes again [m].
    places: np.ndarray
    horizon_s: float  # the time in which many of them shall be passed [s]
    reach: float  # how near they are passed [m]
    limit: float  # how near the task takes them for passed [m]


@dataclass(frozen=True)
class Guess:
    """What optimal control begins from."""

    drive: Drive
    course: np.ndarray  # (legs, 2) places of the waypoints [m]
    wanted: int  # legs that matter
    reach: np.ndarray  # (legs,) how near waypoints are passed [m]
    most: np.ndarray  # (legs,) how near, where that takes too long [m]
    kept: int = 0  # legs at its beginning that stay as they are


Solve = Callable[[Iterable[Guess]], Iterable[Drive | None]]


@dataclass
class Course:
    """An order, and what was found for it."""

    order: Order
    places: np.ndarray  # (legs, 2), as often around as that takes [m]
    reach: np.ndarray  # (legs,) how near each is passed [m]
    most: np.ndarray  # (legs,) how near, where that takes too long [m]
    best: Drive | None = None

    @property
    def worth(self) -> float:
        """Waypoints in time."""
        return -1.0 if self.best is None else self.best.passed(self.order.horizon_s)


class Search:
    """Makes plans, many at once."""

    def __init__(self, beam: Beam, settings: PlannerSettings, solve: Solve, *, dt: float) -> None:
        """Say how.

        Args:
            beam: What finds ways.
            settings: How much to try.
            solve: Makes guesses quick, in their order.
            dt: Control period [s].
        """
        self._beam, self._settings, self._solve, self._dt = beam, settings, solve, dt

    def plans(self, orders: list[Order]) -> list[Course]:
        """A plan for each order.

        Args:
            orders: At least one.

        Returns:
            The courses with the best drives found, none where no way leads to one.
        """
        legs = self._settings.legs
        courses = [
            Course(
                order,
                order.places[np.arange(legs) % len(order.places)],
                reach=np.full(legs, order.reach),
                most=np.full(legs, max(self._settings.most * order.limit, order.reach)),
            )
            for order in orders
        ]
        found = self._beam.ways(
            np.stack([order.start for order in orders]),
            [course.places for course in courses],
            [order.horizon_s for order in orders],
            beyond=_BEYOND + _STRIDE,
        )
        self._take(
            [
                (course, self._first(course, way))
                for course, ways in zip(courses, found, strict=True)
                for way in ways[: self._settings.solved]
            ]
        )
        self._take([(course, self._hurried(course)) for course in courses if course.best is not None])
        return courses

    def nearer(self, failed: list[tuple[Course, np.ndarray]]) -> list[bool]:
        """Have plans pass some waypoints nearer.

        Args:
            failed: Courses with plans, and for each which waypoints it has to pass nearer, shape (legs,).

        Returns:
            Whose plans have changed.
        """
        guesses = []
        for course, which in failed:
            assert course.best is not None
            course.most[: len(which)][which] *= _NEARER
            course.reach = np.minimum(course.reach, course.most)
            first, wanted = int(np.argmax(which)) - 1, int(course.worth) + 1
            guesses.append(self._guess(course, course.best, first, wanted=wanted))
        found = list(self._solve(guesses))
        for (course, _), drive in zip(failed, found, strict=True):
            course.best = drive or course.best
        return [drive is not None for drive in found]

    def _take(self, guesses: list[tuple[Course, Guess]]) -> None:
        """Make guesses quick, and keep what is better than what was known."""
        for (course, _), drive in zip(guesses, self._solve([guess for _, guess in guesses]), strict=True):
            if drive is not None and drive.passed(course.order.horizon_s) > course.worth:
                course.best = drive

    def _first(self, course: Course, way: Way) -> Guess:
        drive = self._drive(way)
        wanted = min(int(drive.passed(course.order.horizon_s)) + _BEYOND, len(drive.leg_s))
        return self._guess(course, drive.before(min(whole(wanted), len(drive.leg_s))), 0, wanted=wanted)

    def _hurried(self, course: Course) -> Guess:
        """The best plan with haste to the last waypoint that may be passed in time, and to none after it."""
        assert course.best is not None
        passed = int(course.worth)
        return self._guess(course, course.best, passed - 2, wanted=passed + 1)

    def _guess(self, course: Course, drive: Drive, leg: int, *, wanted: int) -> Guess:
        """A guess that is changed from a leg on, or from one soon before it."""
        legs = len(drive.leg_s)
        kept = legs - min(whole(legs - max(leg, 0)), legs)
        return Guess(
            drive, course.places[:legs], wanted, course.reach[:legs].copy(), course.most[:legs].copy(), kept
        )

    def _drive(self, way: Way) -> Drive:
        """A way at nodes."""
        t, nodes = self._dt * np.arange(len(way.states)), self._settings.nodes
        pieces, leg_s, last = [], [], 0.0
        for number in range(1, int(way.done[-1]) + 1):
            end = max(self._dt * int(np.argmax(way.done >= number)), last + _SHORTEST_S)
            at = last + (end - last) * np.arange(nodes) / nodes
            pieces.append(np.column_stack([np.interp(at, t, column) for column in way.states.T]))
            leg_s.append(end - last)
            last = end
        return Drive(np.concatenate((*pieces, way.states[-1:])), np.asarray(leg_s))
