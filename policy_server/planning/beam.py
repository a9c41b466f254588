"""Looks for ways along a course by rehearsals: a beam search (Lowerre 1976) over the legs.

A controller drives a leg in one way. Held commands at its beginning make it drive in others, and how a waypoint is
passed decides how quickly the next ones are. So every drive that is kept goes on in many ways, each is driven some
waypoints further, and those that are there first are kept, as far as they pass the waypoint differently.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from fulmar_core.planar import wrapped
from policy_server.planning.boat import Boat
from policy_server.planning.rehearsal import Rehearsal, Rehearsed
from policy_server.planning.settings import PlannerSettings

_SLOWEST_S = 10.0  # time that a leg may take on average [s]
_LIKE_RAD, _LIKE_M_S, _LIKE_S = 0.2, 0.2, 0.4  # below which two ways to pass a waypoint are one


@dataclass(frozen=True)
class Way:
    """A drive as far as it was found."""

    states: np.ndarray  # (steps + 1, size), as of `boat`; a sample each control step
    done: np.ndarray  # (steps + 1,) waypoints passed

    def then(self, states: np.ndarray) -> Way:
        """This way, and states on to the next waypoint; the first of them is its last."""
        before, n = self.done[-1], len(states) - 1
        done = np.concatenate((self.done, np.full(n, before)))
        done[-1] += 1
        return Way(np.concatenate((self.states, states[1:])), done)


@dataclass
class _Search:
    """What is known of one course."""

    places: np.ndarray  # (k, 2) [m]
    horizon: int  # control steps
    ways: list[Way]  # the first is the best
    enough: int | None = None  # legs, as soon as that is known
    rng: np.random.Generator = field(default_factory=lambda: np.random.default_rng(0))


class Beam:
    """Searches of many courses, side by side."""

    def __init__(
        self,
        boat: Boat,
        rehearsal: Rehearsal,
        settings: PlannerSettings,
        dt: float,
        *,
        wanted: Callable[[], bool] = lambda: True,
    ) -> None:
        """Say how.

        Args:
            boat: Whose commands are held.
            rehearsal: Whose drives they are.
            settings: How much to try.
            dt: Control period [s].
            wanted: Whether a search is still of use; asked before each leg.
        """
        self._rehearsal, self._settings, self._dt, self._wanted = rehearsal, settings, dt, wanted
        self._useful = [boat.least, 0.0, boat.most]
        self._slots = len(boat.slew)

    def ways(
        self, starts: np.ndarray, courses: list[np.ndarray], horizons_s: list[float], *, beyond: int
    ) -> list[list[Way]]:
        """Quick drives along courses.

        Args:
            starts: Where they begin, shape (courses, size).
            courses: Waypoints of each from the next one on; after the last the first comes again [m].
            horizons_s: In which as many as possible are to be passed [s].
            beyond: Waypoints that a way goes on for after its horizon; at most `legs` in all.

        Returns:
            Of each course some ways, the best first; none where the controller does not get on, or where a search is
            of no use any more.
        """
        searches = [
            _Search(places, round(horizon_s / self._dt), [Way(start[None], np.zeros(1, dtype=int))])
            for start, places, horizon_s in zip(starts, courses, horizons_s, strict=True)
        ]
        for leg in range(self._settings.legs):
            open_ = [one for one in searches if one.ways and (one.enough is None or leg < one.enough)]
            if not open_:
                break
            if not self._wanted():
                return [[] for _ in searches]
            self._go_on(open_, leg)
            for one in open_:
                if one.enough is None and one.ways and len(one.ways[0].states) > one.horizon:
                    one.enough = leg + 1 + beyond
        return [[way for way in one.ways if way.done[-1]] for one in searches]

    def _go_on(self, searches: list[_Search], leg: int) -> None:
        """One leg further in each."""
        told = self._settings
        tries = told.width * told.tries
        low, high = (int(each / self._dt) for each in told.held_s)
        starts, places, held, commands = [], [], [], []
        for one in searches:
            each = -(-tries // len(one.ways))
            begun = np.repeat(np.stack([way.states[-1] for way in one.ways]), each, axis=0)[:tries]
            holds = one.rng.integers(low, high + 1, tries)
            holds[::each] = 0  # one of each way lets the controller drive on at once
            starts.append(begun)
            places.append(np.repeat(np.roll(one.places, -leg, axis=0)[None], tries, axis=0))
            held.append(holds)
            commands.append(one.rng.choice(self._useful, (tries, self._slots)))
        seen = self._rehearsal.drive(
            np.concatenate(starts),
            np.concatenate(places),
            steps=int(told.ahead * _SLOWEST_S / self._dt),
            until=np.full(len(searches), told.ahead),
            held=np.concatenate(held),
            commands=np.concatenate(commands),
        )
        for number, one in enumerate(searches):
            rows = slice(number * tries, (number + 1) * tries)
            self._keep(one, Rehearsed(seen.states[rows], seen.done[rows]))

    def _keep(self, search: _Search, seen: Rehearsed) -> None:
        """Keep the quickest ways that differ."""
        told, tries = self._settings, len(seen.states)
        each = -(-tries // len(search.ways))
        there = seen.done >= told.ahead
        half = there.mean(axis=0) >= 0.5
        end = int(np.argmax(half)) if half.any() else seen.done.shape[1] - 1
        through = there[:, end]
        spent = np.array([len(way.states) for way in search.ways])[np.arange(tries) // each]
        total = np.where(through, spent + np.argmax(there, axis=1), np.iinfo(int).max)
        found: list[Way] = []
        for row in np.argsort(total, kind="stable"):
            if not through[row] or len(found) == told.width:
                break
            first = int(np.argmax(seen.done[row] >= 1))
            way = search.ways[row // each].then(seen.states[row, : first + 1])
            if not any(self._alike(way, other) for other in found):
                found.append(way)
        search.ways = found

    def _alike(self, way: Way, other: Way) -> bool:
        a, b = way.states[-1], other.states[-1]
        return bool(
            abs(wrapped(a[2] - b[2])) < _LIKE_RAD
            and np.hypot(*(a[3:5] - b[3:5])) < _LIKE_M_S
            and abs(len(way.states) - len(other.states)) * self._dt < _LIKE_S
        )
