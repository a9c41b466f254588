"""Poses that an estimate does not expect: are they true, and the estimate is wrong?

They are if they move as the inertial readings say: through the same way and turn, seen from the body. A source that
repeats itself, stands while the body moves, or creeps, does not.

Inertial readings alone know the velocity for some seconds only. Later a place that creeps steadily looks like a body
that drifts; but it does not stand when the body is turned and then held.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

from fulmar_core.estimators.motion.filter import Placed
from fulmar_core.states.attitude import angle_between
from fulmar_core.states.rotation import multiply, rotate

TO_BEGIN_ANEW = (
    10  # poses beyond the gate in a row that agree with one another and with the inertial readings
)
CONTRADICT_NS = (
    800_000_000  # how long they last before they can contradict: in less, noise hides how they move
)
TO_BEGIN_ANEW_NS = (
    1_800_000_000  # how long they agree to be believed: a body that moves slowly seems to stand
)
PROOF_NS = (
    3_000_000_000  # same, of sources that contradicted each other: a slow drift must grow out of the noise
)
KEPT_NS = 3_200_000_000  # how far apart two of them are compared
WAY_SHARE = 0.05  # of a way by which what is seen and what is expected may differ, as poses may be late
TURN_SHARE = 0.5  # same of a turn
CLOSE_TURN_SHARE = 0.05  # same of a turn, of sources that were off shortly before
SIGMAS = 3.0  # standard deviations of velocity and turn rate that a difference may have
MOVED = 3.0  # a motion of so many times what may differ shows that poses do not stand
PROOF_SHARE = 0.02  # of a way or turn by which sources may differ that contradicted each other before
PROOF_SPEED = 0.05  # same, per second: far less than the 0.2 m/s that are noticed at the first time [m/s]
KNOWN_SPEED = 0.2  # a velocity less well known, by SIGMAS, cannot show that a place creeps [m/s]
HELD_NS = 10_000_000_000  # how long after a turn that both sources saw a body that is held proves the place

NO_TURN = np.array([0.0, 0.0, 0.0, 1.0])
INVERSE = np.array([-1.0, -1.0, -1.0, 1.0])  # makes a unit quaternion its inverse


@dataclass(frozen=True, slots=True)
class Stranger:
    """A pose that was not expected."""

    stamp_ns: int
    seen: Placed
    expected: Placed  # by inertial readings since the last believed pose
    speed_std: float  # of what is expected [m/s]
    rate_std: float  # same [rad/s]


@dataclass(frozen=True, slots=True)
class Agreement:
    """Whether poses move as they are expected to."""

    lasts: bool  # long enough to be believed
    agrees: bool
    closely: bool  # same, with little room for a drift
    proves: bool  # with hardly any, on a motion so large that no source that stands, creeps or drifts could


class Strangers:
    """Poses in a row that were not expected."""

    def __init__(self, *, speed: float, slack: float, turn_slack: float) -> None:
        """Begin without any.

        Args:
            speed: The body's largest [m/s].
            slack: Distance between two poses that their noise explains [m].
            turn_slack: Angle between two poses that their noise explains [rad].
        """
        self._speed, self._slack, self._turn_slack = speed, slack, turn_slack
        self._met: deque[Stranger] = deque()
        self._turned_ns: int | None = None  # when both sources saw a large turn, one and the same

    def forget(self) -> None:
        """Begin anew, as after a pose that was expected."""
        self._met.clear()
        self._turned_ns = None

    def meet(self, stranger: Stranger, *, for_ns: int = CONTRADICT_NS) -> Agreement | None:
        """Note one more; None as long as those that go together are too few, or do not last for a time [ns]."""
        if self._met and not self._follows(self._met[-1], stranger):
            self._met.clear()
        self._met.append(stranger)
        while stranger.stamp_ns - self._met[0].stamp_ns > KEPT_NS:
            self._met.popleft()
        first = self._met[0]
        if len(self._met) < TO_BEGIN_ANEW or stranger.stamp_ns - first.stamp_ns < for_ns:
            return None
        return self._compare(first, stranger)

    def _follows(self, last: Stranger, new: Stranger) -> bool:
        """Whether a body can get from one to the other."""
        apart = float(np.linalg.norm(new.seen[0] - last.seen[0]))
        return apart <= self._speed * (new.stamp_ns - last.stamp_ns) / 1e9 + self._slack

    def _compare(self, first: Stranger, last: Stranger) -> Agreement:
        seconds = (last.stamp_ns - first.stamp_ns) / 1e9
        way, turn = _between(first.seen, last.seen)
        expected_way, expected_turn = _between(first.expected, last.expected)
        ways = float(np.linalg.norm(way)), float(np.linalg.norm(expected_way))
        turns = _angle(NO_TURN, turn), _angle(NO_TURN, expected_turn)
        turn_slack = self._turn_slack + SIGMAS * last.rate_std * seconds
        way_slack = self._slack + SIGMAS * last.speed_std * seconds
        off, turned_off = float(np.linalg.norm(way - expected_way)), _angle(expected_turn, turn)

        ways_agree = off <= way_slack + WAY_SHARE * max(ways)
        agrees = ways_agree and turned_off <= turn_slack + TURN_SHARE * max(turns)
        closely = ways_agree and turned_off <= turn_slack + CLOSE_TURN_SHARE * max(turns)
        lasts_ns = last.stamp_ns - first.stamp_ns
        proves = lasts_ns >= PROOF_NS and self._proves(last, ways, off, turns, turned_off)
        return Agreement(lasts_ns >= TO_BEGIN_ANEW_NS, agrees, closely, proves)

    def _proves(
        self,
        last: Stranger,
        ways: tuple[float, float],
        off: float,
        turns: tuple[float, float],
        turned_off: float,
    ) -> bool:
        """Whether sources that contradicted each other agree on a motion; those seen first, then those expected."""
        seconds = PROOF_NS / 1e9
        turn_slack = self._turn_slack + SIGMAS * last.rate_std * seconds
        if turned_off > turn_slack + PROOF_SHARE * max(turns):
            self._turned_ns = None
            return False
        turned = min(turns) > MOVED * turn_slack
        if turned:
            self._turned_ns = last.stamp_ns
        way_slack = self._slack + PROOF_SPEED * seconds
        if SIGMAS * last.speed_std <= KNOWN_SPEED:
            agree = off <= way_slack + PROOF_SHARE * max(ways)
            return agree and (turned or min(ways) > MOVED * way_slack)
        lately = self._turned_ns is not None and last.stamp_ns - self._turned_ns <= HELD_NS
        return lately and not turned and ways[0] <= self._slack


def _between(a: Placed, b: Placed) -> tuple[np.ndarray, np.ndarray]:
    """Way and turn from one place to another, seen from the body at the first, shapes (3,) and (4,)."""
    back = a[1] * INVERSE
    return np.asarray(rotate(back, b[0] - a[0])), np.asarray(multiply(back, b[1]))


def _angle(a: np.ndarray, b: np.ndarray) -> float:
    """Between two attitudes [rad]."""
    return float(angle_between(tuple(a), tuple(b)))
