"""Whether the pose of odometry moves as its twist says, over some seconds.

Odometry that was fused never repeats a value to the last bit, whatever fails below it. But a pose that stands or creeps
and a twist that says otherwise cannot both be true; nor can a pose that moves and a twist that stands.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

from fulmar_core.robots.sensors.odometer import Channel, OdometrySpec
from fulmar_core.states.rotation import turn_between
from fulmar_core.states.state import RigidBodyState

WINDOW_NS = 20_000_000_000  # how far back is compared
SHORT_NS = 1_000_000_000  # the nearer of two times that are compared
GAP_NS = 1_000_000_000  # between two measurements: what happened meanwhile is not known
FEWEST = 8  # measurements: fewer may be late by as much as a motion lasts
SIGMAS = 8.0  # of the pose's noise
RATE_SIGMAS = 2.0  # of the twist's noise, as if it were a bias
WHITE_SIGMAS = 6.0  # of what white noise of the twist adds up to, as it is found in the measurements
SHARE = 0.004  # of the way, by which its length may be wrong
LATE_S = 0.1  # by which the pose may be later than the twist [s]
LEAST = 0.03  # difference that is none, whatever the robot's file says [m, rad]
JUMP = 10.0  # standard deviations of a pose that are a correction, and no motion
JUMPS = 3  # corrections in the window: more are a motion in steps
PROOF = 0.3  # way or turn by the twist in the window with which a pose that agrees does not stand [m, rad]


Three = Sequence[float]


@dataclass(slots=True)
class Sums:
    """What adds up, of position or of attitude; numbers from the first measurement on."""

    off: Three  # change of the pose less the twist's
    way: float  # by the twist: differences of a noisy pose add up
    squares: float  # of differences of two twists in a row
    count: int
    jumps: int


NOTHING = Sums((0.0, 0.0, 0.0), 0.0, 0.0, 0, 0)


class Part:
    """Position or attitude."""

    def __init__(self, pose: Channel, rate: Channel) -> None:
        """Take the noise of the pose, and of its rate."""
        self._least = max(SIGMAS * pose.std, LEAST)
        self._jump = JUMP * max(pose.std, 0.2 * LEAST)
        self._drift = RATE_SIGMAS * rate.std + 4.0 * rate.bias_std
        self._share = SHARE + 4.0 * (pose.scale_std + rate.scale_std)

    def add(self, sums: Sums, moved: Three, before: Three, now: Three, seconds: float) -> Sums:
        """Sums with one more measurement: how the pose moved, and the rates before and now."""
        half = 0.5 * seconds
        by_rate = half * (before[0] + now[0]), half * (before[1] + now[1]), half * (before[2] + now[2])
        off, jumps = _minus(moved, by_rate), sums.jumps
        size = math.hypot(*by_rate)
        most = max(math.hypot(*before), math.hypot(*now))
        if math.hypot(*off) > self._jump + LATE_S * most + self._share * size:
            off, jumps = (0.0, 0.0, 0.0), jumps + 1
        change = math.hypot(*_minus(now, before))
        return Sums(
            (sums.off[0] + off[0], sums.off[1] + off[1], sums.off[2] + off[2]),
            sums.way + size,
            sums.squares + (change * seconds) ** 2,
            sums.count + 1,
            jumps,
        )

    def agrees(self, then: Sums, now: Sums, seconds: float, change: float) -> bool:
        """Whether pose and rate agree on what happened between two times, between which the rate changed."""
        if now.count - then.count < FEWEST:
            return True
        white = WHITE_SIGMAS * math.sqrt(0.5 * max(now.squares - then.squares, 0.0))
        allowed = self._least + self._drift * seconds + self._share * (now.way - then.way)
        off = math.hypot(*_minus(now.off, then.off))
        return off <= allowed + white + LATE_S * change and now.jumps - then.jumps <= JUMPS


@dataclass(slots=True)
class Past:
    """A measurement, and what had added up by then."""

    stamp_ns: int
    position: Three  # numbers of the state, which cost less than arrays of three
    attitude: Sequence[float]
    velocity: Three
    turning: Three
    place: Sums
    turn: Sums


class MotionAgreement:
    """Pose and twist of odometry, one measurement after the other."""

    def __init__(self, spec: OdometrySpec) -> None:
        """Begin without a measurement; the robot's file says how noisy its odometry is."""
        self._place, self._turn = Part(spec.position, spec.velocity), Part(spec.heading, spec.yaw_rate)
        self.forget()

    def forget(self) -> None:
        """Begin anew."""
        self._past: deque[Past] = deque()
        self._recent: deque[Past] = deque()

    @property
    def proves(self) -> bool:
        """Whether the whole window has a motion so large that no pose which stands would agree."""
        if not self._past:
            return False
        first, last = self._past[0], self._past[-1]
        lasts = last.stamp_ns - first.stamp_ns > WINDOW_NS - GAP_NS
        return lasts and max(last.place.way - first.place.way, last.turn.way - first.turn.way) > PROOF

    def agrees(self, stamp_ns: int, state: RigidBodyState) -> bool:
        """Note the next measurement; whether its pose and those before it moved as their twists say."""
        if self._past and stamp_ns - self._past[-1].stamp_ns > GAP_NS:
            self.forget()
        position, attitude = state.position_in_world.tolist(), state.quat_xyzw.tolist()
        velocity, turning = state.velocity_in_world.tolist(), state.angular_velocity_in_body.tolist()
        now = Past(stamp_ns, position, attitude, velocity, turning, NOTHING, NOTHING)
        self._recent.append(now)
        if not self._past:
            self._past.append(now)
            return True
        self._add(self._past[-1], now)
        self._past.append(now)
        while stamp_ns - self._past[1].stamp_ns > WINDOW_NS:
            self._past.popleft()
        recent = self._recent  # and the newest that is not
        while len(recent) > 1 and stamp_ns - recent[1].stamp_ns >= SHORT_NS:
            recent.popleft()
        whole = self._agree(self._past[0], now)
        return whole and (stamp_ns - recent[0].stamp_ns < SHORT_NS or self._agree(recent[0], now))

    def _add(self, last: Past, now: Past) -> None:
        seconds = (now.stamp_ns - last.stamp_ns) / 1e9
        way, turn = _minus(now.position, last.position), _turn(last.attitude, now.attitude)
        now.place = self._place.add(last.place, way, last.velocity, now.velocity, seconds)
        now.turn = self._turn.add(last.turn, turn, last.turning, now.turning, seconds)

    def _agree(self, then: Past, now: Past) -> bool:
        seconds = (now.stamp_ns - then.stamp_ns) / 1e9
        change = math.hypot(*_minus(now.velocity, then.velocity))
        turning = math.hypot(*_minus(now.turning, then.turning))
        return self._place.agrees(then.place, now.place, seconds, change) and self._turn.agrees(
            then.turn, now.turn, seconds, turning
        )


def _turn(a: Sequence[float], b: Sequence[float]) -> Three:
    """Small rotation from one attitude to another, about the body's axes [rad]."""
    x, y, z, w = turn_between(a, b)
    sign = math.copysign(1.0, w)
    return 2.0 * (sign * x), 2.0 * (sign * y), 2.0 * (sign * z)


def _minus(a: Three, b: Three) -> Three:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]
