"""Poses that an estimate does not expect: are they true, and the estimate is wrong?

They are if they move as the inertial readings say: through the same way and turn, seen from the body. A source that
repeats itself, stands while the body moves, or creeps, does not.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

from fulmar_core.attitude import angle_between
from fulmar_core.estimation.filter import Placed
from fulmar_core.rotation import multiply, rotate

TO_BEGIN_ANEW = (
    10  # poses beyond the gate in a row that agree with one another and with the inertial readings
)
TO_BEGIN_ANEW_NS = 800_000_000  # and that long: in less, noise hides how they move
AGAIN_NS = 1_800_000_000  # same, shortly after an estimate began anew
KEPT_NS = 2_000_000_000  # how far apart two of them are compared
WAY_SHARE = 0.15  # of a way by which what is seen and what is expected may differ, as poses may be late
TURN_SHARE = 0.5  # same of a turn
CLOSE_TURN_SHARE = 0.15  # same of a turn, of sources that were off shortly before
SIGMAS = 3.0  # standard deviations of velocity and turn rate that a difference may have
MOVED = 3.0  # a motion of so many times what may differ shows that poses do not stand

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

    agrees: bool
    closely: bool  # same, with little room for a drift
    proves: bool  # same, on a motion so large that no source that stands could


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

    def forget(self) -> None:
        """Begin anew, as after a pose that was expected."""
        self._met.clear()

    def meet(self, stranger: Stranger, *, for_ns: int = TO_BEGIN_ANEW_NS) -> Agreement | None:
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
        moved = ways[0] > MOVED * way_slack or turns[0] > MOVED * turn_slack

        ways_agree = off <= way_slack + WAY_SHARE * max(ways)
        agrees = ways_agree and turned_off <= turn_slack + TURN_SHARE * max(turns)
        closely = ways_agree and turned_off <= turn_slack + CLOSE_TURN_SHARE * max(turns)
        return Agreement(agrees, closely, moved and closely)


def _between(a: Placed, b: Placed) -> tuple[np.ndarray, np.ndarray]:
    """Way and turn from one place to another, seen from the body at the first, shapes (3,) and (4,)."""
    back = a[1] * INVERSE
    return np.asarray(rotate(back, b[0] - a[0])), np.asarray(multiply(back, b[1]))


def _angle(a: np.ndarray, b: np.ndarray) -> float:
    """Between two attitudes [rad]."""
    return float(angle_between(tuple(a), tuple(b)))
