"""Looks for quick drives of courses: the controller's own, then optimal control, then detours and optimal control.

Optimal control alone ends at the quickest drive near its guess. Another way around a waypoint is another valley, and
one is found by large neighbourhood search (Shaw 1998): the boat leaves the best plan somewhere, holds random commands
for a while and lets the controller drive on; the quickest of some such detours is the next guess.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

import numpy as np

from policy_server.planning.boat import Boat
from policy_server.planning.program import Drive
from policy_server.planning.rehearsal import Rehearsal
from policy_server.planning.settings import PlannerSettings

_SLOWEST_S = 15.0  # time that a controller may take for a leg on average [s]
_SHORTEST_S = 0.06  # of a leg in a guess [s]


@dataclass(frozen=True)
class Order:
    """What a plan is asked for."""

    start: np.ndarray  # state that it begins in, shape (size,), as of `boat`
    # Of the waypoints from the next one on, shape (k, 2); after the last the first comes again [m].
    places: np.ndarray
    horizon_s: float  # the time in which many of them shall be passed [s]
    reach: float  # how near they are passed [m]


@dataclass(frozen=True)
class Guess:
    """What optimal control begins from."""

    drive: Drive
    course: np.ndarray  # (legs, 2) places of the waypoints [m]
    wanted: int  # legs that matter
    reach: float  # how near waypoints are passed [m]


Solve = Callable[[Iterable[Guess]], Iterable[Drive | None]]


@dataclass
class _Course:
    """An order, and what was found for it."""

    order: Order
    places: np.ndarray  # (legs, 2), as often around as that takes [m]
    best: Drive | None = None
    # The same order has the same plan, whatever else is ordered with it.
    rng: np.random.Generator = field(default_factory=lambda: np.random.default_rng(0))

    @property
    def worth(self) -> float:
        """Waypoints in time."""
        return -1.0 if self.best is None else self.best.passed(self.order.horizon_s)


@dataclass(frozen=True)
class _Detours:
    """Drives that leave one plan at one of its nodes; all of them go through the same legs."""

    leg: int  # of the plan, in which they leave it
    node: int  # of the plan, at which they do
    legs: int  # to drive, from that one on
    starts: np.ndarray  # (tries, size)
    places: np.ndarray  # (tries, k, 2) waypoints from the end of that leg on [m]
    held: np.ndarray  # (tries,) control steps for which commands are held
    commands: np.ndarray  # (tries, n)


class Search:
    """Makes plans, many at once: all their detours are driven side by side."""

    def __init__(
        self, boat: Boat, rehearsal: Rehearsal, settings: PlannerSettings, solve: Solve, *, dt: float
    ) -> None:
        """Say how.

        Args:
            boat: Whose plans they are.
            rehearsal: Of the controller that guesses.
            settings: How much to try.
            solve: Makes guesses quick, in their order.
            dt: Control period [s].
        """
        self._boat, self._rehearsal = boat, rehearsal
        self._settings, self._solve, self._dt = settings, solve, dt

    def plans(self, orders: list[Order]) -> list[Drive | None]:
        """A drive for each order.

        Args:
            orders: At least one.

        Returns:
            The best drives found; None where not even the first guess leads to one.
        """
        legs = self._settings.legs
        courses = [_Course(order, order.places[np.arange(legs) % len(order.places)]) for order in orders]
        self._take(courses, self._firsts(courses))
        for _ in range(self._settings.rounds):
            if not threading.main_thread().is_alive():
                break  # the process ends, and waits for this thread alone
            planned = [course for course in courses if course.best is not None]
            if planned:
                self._take(planned, self._others(planned))
        return [course.best for course in courses]

    def _take(self, courses: list[_Course], guesses: list[Guess | None]) -> None:
        """Make guesses quick, and keep what is better than what was known."""
        asked = [(course, guess) for course, guess in zip(courses, guesses, strict=True) if guess is not None]
        for (course, _), drive in zip(asked, self._solve([guess for _, guess in asked]), strict=True):
            if drive is not None and drive.passed(course.order.horizon_s) > course.worth:
                course.best = drive

    def _firsts(self, courses: list[_Course]) -> list[Guess | None]:
        """What the controller does by itself."""
        legs = self._settings.legs
        seen = self._rehearsal.drive(
            np.stack([course.order.start for course in courses]),
            np.stack([course.places for course in courses]),
            steps=int(legs * _SLOWEST_S / self._dt),
            until=np.full(len(courses), legs),
        )
        guesses: list[Guess | None] = []
        for course, states, done in zip(courses, seen.states, seen.done, strict=True):
            if done[-1] < legs:
                guesses.append(None)
                continue
            end = int(np.argmax(done >= legs)) + 1
            drive = self._joined(
                Drive(course.order.start[None], np.zeros(0)), states[:end], done[:end], since=0.0
            )
            wanted = self._wanted(drive, course.order.horizon_s)
            guesses.append(Guess(drive, course.places, wanted, course.order.reach))
        return guesses

    def _others(self, courses: list[_Course]) -> list[Guess | None]:
        """The best plans with a detour in each."""
        every = [self._detours(course) for course in courses]
        tries, ends = self._settings.detours, np.array([detours.legs for detours in every])
        seen = self._rehearsal.drive(
            np.concatenate([detours.starts for detours in every]),
            np.concatenate([detours.places for detours in every]),
            steps=int(ends.max() * _SLOWEST_S / self._dt),
            until=ends,
            held=np.concatenate([detours.held for detours in every]),
            commands=np.concatenate([detours.commands for detours in every]),
        )
        states, done = (each.reshape(len(every), tries, *each.shape[1:]) for each in (seen.states, seen.done))
        return [self._quickest(*of_one) for of_one in zip(courses, every, states, done, strict=True)]

    def _detours(self, course: _Course) -> _Detours:
        """Detours that leave the best plan of a course at one of its nodes, drawn at random."""
        told, rng, best = self._settings, course.rng, course.best
        assert best is not None
        wanted = self._wanted(best, course.order.horizon_s)
        leg = int(rng.integers(0, max(int(course.worth), 1)))
        node = leg * told.nodes + int(rng.integers(0, told.nodes))
        low, high = (int(each / self._dt) for each in told.detour_s)
        held = rng.integers(low, high + 1, told.detours)
        held[0] = 0  # one lets the controller drive on at once
        useful = [self._boat.least, 0.0, self._boat.most]
        return _Detours(
            leg,
            node,
            legs=wanted - leg,
            starts=np.repeat(best.states[node][None], told.detours, axis=0),
            places=np.repeat(np.roll(course.places, -leg, axis=0)[None], told.detours, axis=0),
            held=held,
            commands=rng.choice(useful, (told.detours, len(self._boat.slew))),
        )

    def _quickest(
        self, course: _Course, detours: _Detours, states: np.ndarray, done: np.ndarray
    ) -> Guess | None:
        """The plan with the detour that was through first; None where none was.

        Args:
            course: Whose plan it is.
            detours: What was driven.
            states: Of each detour, shape (tries, steps + 1, size).
            done: Waypoints that each has passed, shape (tries, steps + 1).
        """
        best = course.best
        assert best is not None
        if done.max() < detours.legs:
            return None
        end = int(np.argmax(done.max(axis=0) >= detours.legs)) + 1
        first = int(np.argmax(done[:, end - 1]))
        before = Drive(best.states[: detours.node + 1], best.leg_s[: detours.leg])
        since = float(best.times[detours.node] - best.times[detours.leg * self._settings.nodes])
        drive = self._joined(before, states[first, :end], done[first, :end], since=since)
        wanted = detours.leg + detours.legs
        return Guess(self._completed(drive, best), course.places, wanted, course.order.reach)

    def _wanted(self, drive: Drive, horizon_s: float) -> int:
        """How many legs matter: those in time, and two more, without which the last ones would be greedy."""
        return min(int(drive.passed(horizon_s)) + 2, self._settings.legs)

    def _joined(self, before: Drive, states: np.ndarray, done: np.ndarray, *, since: float) -> Drive:
        """A drive whose first legs are of a plan and whose others are of a rehearsal.

        Args:
            before: Nodes up to the one where the rehearsal begins, and times of the whole legs among them.
            states: Of the rehearsal, shape (steps + 1, size).
            done: Waypoints that it has passed, shape (steps + 1,).
            since: How long the leg that it begins in has lasted [s].
        """
        nodes, legs = self._settings.nodes, len(before.leg_s)
        begun = before.states[legs * nodes : -1]  # of the leg in which the rehearsal begins
        lasted = since * np.arange(len(begun)) / max(len(begun), 1)
        t = np.concatenate((lasted, since + self._dt * np.arange(len(states))))
        path = np.concatenate((begun, states))
        pieces, leg_s, last = [before.states[: legs * nodes]], list(before.leg_s), 0.0
        for number in range(1, int(done[-1]) + 1):
            end = max(since + self._dt * int(np.argmax(done >= number)), last + _SHORTEST_S)
            at = last + (end - last) * np.arange(nodes) / nodes
            pieces.append(np.column_stack([np.interp(at, t, column) for column in path.T]))
            leg_s.append(end - last)
            last = end
        return Drive(np.concatenate((*pieces, states[-1:])), np.asarray(leg_s))

    def _completed(self, drive: Drive, plan: Drive) -> Drive:
        """A drive with the legs that it lacks of a plan."""
        legs = len(drive.leg_s)
        rest = plan.states[legs * self._settings.nodes :].copy()
        rest[:, 2] += 2.0 * np.pi * np.round((drive.states[-1, 2] - rest[0, 2]) / (2.0 * np.pi))
        return Drive(
            np.concatenate((drive.states[:-1], rest)), np.concatenate((drive.leg_s, plan.leg_s[legs:]))
        )
