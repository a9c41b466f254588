"""Whether the pose of odometry moves as its twist says, over some seconds.

Odometry that was fused never repeats a value to the last bit, whatever fails below it. But a pose that stands or creeps
and a twist that says otherwise cannot both be true; nor can a pose that moves and a twist that stands.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np

from fulmar_core.robots.sensors.odometer import Channel, OdometrySpec
from fulmar_core.states.attitude import conjugate, product
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


@dataclass(frozen=True, slots=True)
class Sums:
    """What adds up, of position or of attitude; numbers from the first measurement on."""

    off: np.ndarray  # change of the pose less the twist's, (3,)
    way: float  # by the twist: differences of a noisy pose add up
    squares: float  # of differences of two twists in a row
    count: int
    jumps: int


NOTHING = Sums(np.zeros(3), 0.0, 0.0, 0, 0)


class Part:
    """Position or attitude."""

    def __init__(self, pose: Channel, rate: Channel) -> None:
        """Take the noise of the pose, and of its rate."""
        self._least = max(SIGMAS * pose.std, LEAST)
        self._jump = JUMP * max(pose.std, 0.2 * LEAST)
        self._drift = RATE_SIGMAS * rate.std + 4.0 * rate.bias_std
        self._share = SHARE + 4.0 * (pose.scale_std + rate.scale_std)

    def add(self, sums: Sums, moved: np.ndarray, before: np.ndarray, now: np.ndarray, seconds: float) -> Sums:
        """Sums with one more measurement: how the pose moved, and the rates before and now."""
        by_rate = 0.5 * seconds * (before + now)
        off, jumps = moved - by_rate, sums.jumps
        size = _norm(by_rate)
        if _norm(off) > self._jump + LATE_S * max(_norm(before), _norm(now)) + self._share * size:
            off, jumps = np.zeros(3), jumps + 1
        change = _norm(now - before)
        return Sums(
            sums.off + off,
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
        off = _norm(now.off - then.off)
        return off <= allowed + white + LATE_S * change and now.jumps - then.jumps <= JUMPS


@dataclass(frozen=True, slots=True)
class Past:
    """A measurement, and what had added up by then."""

    stamp_ns: int
    state: RigidBodyState
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
        if not self._past:
            self._past.append(Past(stamp_ns, state, NOTHING, NOTHING))
            return True
        last = self._past[-1]
        now = self._added(last, stamp_ns, state)
        self._past.append(now)
        while stamp_ns - self._past[1].stamp_ns > WINDOW_NS:
            self._past.popleft()
        short = next((past for past in reversed(self._past) if stamp_ns - past.stamp_ns >= SHORT_NS), None)
        return all(self._agree(then, now) for then in (self._past[0], short) if then is not None)

    def _added(self, last: Past, stamp_ns: int, state: RigidBodyState) -> Past:
        seconds, before = (stamp_ns - last.stamp_ns) / 1e9, last.state
        way = state.position_in_world - before.position_in_world
        turn = _turn(before.quat_xyzw, state.quat_xyzw)
        return Past(
            stamp_ns,
            state,
            self._place.add(last.place, way, before.velocity_in_world, state.velocity_in_world, seconds),
            self._turn.add(
                last.turn, turn, before.angular_velocity_in_body, state.angular_velocity_in_body, seconds
            ),
        )

    def _agree(self, then: Past, now: Past) -> bool:
        seconds = (now.stamp_ns - then.stamp_ns) / 1e9
        change = now.state.velocity_in_world - then.state.velocity_in_world
        turning = now.state.angular_velocity_in_body - then.state.angular_velocity_in_body
        return self._place.agrees(then.place, now.place, seconds, _norm(change)) and self._turn.agrees(
            then.turn, now.turn, seconds, _norm(turning)
        )


def _turn(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Small rotation from one attitude to another, about the body's axes, (3,) [rad]."""
    x, y, z, w = product(conjugate(tuple(a.tolist())), tuple(b.tolist()))
    half = math.copysign(1.0, w) * np.array([x, y, z])
    return np.asarray(2.0 * half)


def _norm(vector: np.ndarray) -> float:
    return math.hypot(*vector.tolist())
