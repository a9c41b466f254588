"""One boat that is brought along a reference, step by step."""

from __future__ import annotations

from concurrent.futures import Future

import numpy as np

from policy_server.planning.boat import MOTION
from policy_server.planning.reference import Reference
from policy_server.planning.settings import PlannerSettings
from policy_server.planning.whereabouts import Whereabouts, locate

_FURTHER = 2  # control steps by which a reference goes on at most in one; 0 where the boat is behind it
_SLIP = 1e-3  # cost of going on by another number of steps than one, for a boat beside its plan [m²]
# Weights of what a boat's motion differs by from a reference's, which tell how far along it the boat is [1/m², ..].
_NEARNESS = np.array([1.0, 1.0, 0.3, 0.1, 0.1, 0.1])


class Pilot:
    """What is known of one boat: its course, the reference that it follows, and the plan that is being made."""

    def __init__(self, places: np.ndarray, settings: PlannerSettings, *, late_steps: int) -> None:
        """Nothing is followed yet.

        Args:
            places: Waypoints of the course, shape (k, 2) [m].
            settings: When to give a reference up.
            late_steps: How late a waypoint may be passed [control steps].
        """
        self.places = places
        # Plans that are being made, and which of them is this boat's.
        self.ordered: tuple[Future[list[Reference | None]], int] | None = None
        self.steps = 0  # since the course was heard
        self.losses = 0  # plans that had to be given up
        self._course = places[:, 0] + 1j * places[:, 1]
        self._settings, self._late = settings, late_steps
        self._where: Whereabouts | None = None
        self._reference: Reference | None = None
        self._at = 0  # control step of the reference
        self._first = 0  # number of the waypoint that is the first of its arrivals

    @property
    def coming(self) -> int:
        """Number of the next waypoint."""
        assert self._where is not None
        return self._where.coming

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
        self.steps += 1
        return np.concatenate(([self._where.x, self._where.y, self._where.yaw], motion, commands))

    def follow(self, reference: Reference) -> None:
        """Begin another reference, which begins where the boat is."""
        self._reference, self._at, self._first = reference, -1, self.coming

    def go_on(self, plan: Reference) -> None:
        """Have a plan follow the reference that ends."""
        assert self._reference is not None
        self._reference = self._reference.then(plan)

    @property
    def at_end(self) -> bool:
        """Whether the reference says nothing about the next step."""
        return self._reference is None or self._at + 1 >= len(self._reference.changes)

    def is_lost(self, state: np.ndarray) -> bool:
        """Find how far along the reference the boat is, and say whether it is too far from it, or missed a waypoint."""
        reference = self._reference
        assert reference is not None
        if self._at < 0:
            self._at = 0
        else:
            low = self._at
            window = reference.states[low : min(low + _FURTHER + 1, len(reference.changes)), :MOTION]
            off = (state[:MOTION] - window) ** 2 @ _NEARNESS
            self._at = low + int(np.argmin(off + _SLIP * (np.arange(len(window)) - 1) ** 2))
        away = state[:2] - reference.states[self._at, :2]
        passed = (self.coming - self._first) % len(self.places)
        due = int(np.sum(reference.arrivals + self._late < self._at))
        # A course goes round: who is a lap behind looks as if nothing were missed, but is lost by then.
        return bool(
            np.hypot(*away) > self._settings.lost
            or 0 < (due - passed) % len(self.places) < len(self.places) / 2
        )

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
