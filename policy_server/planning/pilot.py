"""One boat that is brought along a reference, step by step."""

from __future__ import annotations

from concurrent.futures import Future

import numpy as np

from fulmar_core.controllers.course import further
from policy_server.planning.boat import MOTION
from policy_server.planning.reference import Reference
from policy_server.planning.settings import PlannerSettings
from policy_server.planning.whereabouts import Whereabouts, locate

_AROUND = 8  # control steps around the one in which a waypoint should be passed
_FURTHER = 2  # control steps by which a reference goes on at most in one; 0 where the boat is behind it
_SLIP = 1e-3  # cost of going on by another number of steps than one, for a boat beside its plan [m²]
# Weights of what a boat's motion differs by from a reference's, which tell how far along it the boat is [1/m², ..].
_NEARNESS = np.array([1.0, 1.0, 0.3, 0.1, 0.1, 0.1])


class Pilot:
    """What is known of one boat: its course, the reference that it follows, and the plan that is being made."""

    def __init__(
        self,
        places: np.ndarray,
        settings: PlannerSettings,
        *,
        limit: float,
        late_steps: int,
        where: Whereabouts | None = None,
    ) -> None:
        """Nothing is followed yet.

        Args:
            places: Waypoints of the course, shape (k, 2) [m].
            settings: When to give a reference up.
            limit: How near the task takes a waypoint for passed [m].
            late_steps: How late a waypoint may be passed [control steps].
            where: Where it was a step ago, if that is known.
        """
        self.places = places
        # Plans that are being made, and which of them is this boat's.
        self.ordered: tuple[Future[list[Reference | None]], int] | None = None
        self.steps = 0  # since the course was heard
        self.losses = 0  # plans that had to be given up
        self._course = places[:, 0] + 1j * places[:, 1]
        self._settings, self._late = settings, late_steps
        self._sure = settings.believed * limit
        self._where = where
        self._reference: Reference | None = None
        self._at = 0  # control step of the reference
        self._closest = np.zeros(0)  # how near each of its waypoints was passed [m]
        self._first = 0  # number of the waypoint that is the first of its arrivals

    @property
    def coming(self) -> int:
        """Number of the next waypoint, as far as is known, by us or by others."""
        assert self._where is not None
        ahead = int(further(self._where.coming, self._counted, len(self.places)))
        return (self._counted + ahead) % len(self.places)

    @property
    def _counted(self) -> int:
        """The same as far as the reference tells."""
        assert self._where is not None
        if self._reference is None:
            return self._where.coming
        return (self._first + self._next) % len(self.places)

    @property
    def _next(self) -> int:
        """The first of the reference's waypoints that was not passed."""
        return int(np.argmin(np.append(self._passed, False)))

    @property
    def _passed(self) -> np.ndarray:
        """Which of the reference's waypoints were passed."""
        return self._closest < self._sure

    def see(self, sight: np.ndarray, motion: np.ndarray, commands: np.ndarray) -> np.ndarray:
        """Take an observation.

        Args:
            sight: Waypoints in sight, as of `locate`.
            motion: Speed ahead, to the left, and turn rate, shape (3,).
            commands: What was commanded last, shape (n,).

        Returns:
            The state, shape (size,), as of `boat`.
        """
        self._where = locate(sight, self._course, self._where)
        passed = int(further(self._where.coming, self._counted, len(self.places)))
        self._closest[self._next : self._next + passed] = 0.0  # as others know
        self.steps += 1
        return np.concatenate(([self._where.x, self._where.y, self._where.yaw], motion, commands))

    def follow(self, reference: Reference) -> None:
        """Begin another reference, which begins where the boat is."""
        self._first = self.coming
        self._reference, self._at = reference, 0
        self._closest = np.full(len(reference.arrivals), np.inf)

    def go_on(self, plan: Reference) -> None:
        """Have a plan follow the reference that ends."""
        assert self._reference is not None
        self._reference = self._reference.then(plan)
        self._closest = np.append(self._closest, np.full(len(plan.arrivals), np.inf))

    @property
    def at_end(self) -> bool:
        """Whether the reference says nothing about the next step."""
        return self._reference is None or self._at + 1 >= len(self._reference.changes)

    def is_lost(self, state: np.ndarray) -> bool:
        """Find how far along the reference the boat is, and say whether it is too far from it, or missed a waypoint."""
        reference = self._reference
        assert reference is not None
        low = self._at
        window = reference.states[low : min(low + _FURTHER + 1, len(reference.changes)), :MOTION]
        off = (state[:MOTION] - window) ** 2 @ _NEARNESS
        self._at = low + int(np.argmin(off + _SLIP * (np.arange(len(window)) - 1) ** 2))
        away = state[:2] - reference.states[self._at, :2]
        near = np.flatnonzero(np.abs(reference.arrivals - self._at) <= _AROUND)
        if len(near):
            off = np.hypot(*(self.places[(self._first + near) % len(self.places)] - state[:2]).T)
            self._closest[near] = np.minimum(self._closest[near], off)
        due = reference.arrivals + self._late < self._at
        return bool(np.hypot(*away) > self._settings.lost or (due & ~self._passed).any())

    def command(self, state: np.ndarray, slew_step: np.ndarray) -> np.ndarray:
        """The next command, shape (n,).

        Args:
            state: Of the boat, as of `see`.
            slew_step: By how much each command may change, shape (n,).
        """
        reference = self._reference
        assert reference is not None
        deviation = state - reference.states[self._at]
        change = reference.changes[self._at] - reference.gains[self._at] @ deviation
        return np.asarray(state[MOTION:] + np.clip(change, -1.0, 1.0) * slew_step)
