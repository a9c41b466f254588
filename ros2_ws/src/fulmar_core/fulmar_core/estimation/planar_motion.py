"""Poses and inertial readings in any order of arrival, to one estimate at the newest of their times.

A pose is as old as its capture, and inertial readings have come since: the filter goes back to the time of capture,
takes the pose in, and repeats what came after it.
"""

from __future__ import annotations

import bisect
import math
from dataclasses import dataclass

import numpy as np

from fulmar_core.dynamics.hydrodynamics import GRAVITY
from fulmar_core.estimation.motion_filter import (
    MOTION,
    POSE,
    RATE,
    VX,
    VY,
    YAW,
    MotionFilter,
    Snapshot,
    X,
    Y,
)
from fulmar_core.estimation.settings import EstimatorSettings
from fulmar_core.robot import Limits
from fulmar_core.rotation import from_yaw, multiply, rotate, yaw_of
from fulmar_core.safety.input_gate import BACK_NS, FORWARD_NS
from fulmar_core.sensors.imu import ImuSample
from fulmar_core.state import RigidBodyState

KEPT_NS = 1_000_000_000  # how far back an estimate can be corrected
READING_LASTS_NS = 60_000_000  # how long after it an inertial reading still stands for what happens
TO_BEGIN_ANEW = 10  # outliers in a row that agree with one another: then it is the estimate that is wrong
KNOWN_SPEED_STD = 0.15  # velocity must be known so well before an estimate is published [m/s]


@dataclass(frozen=True, slots=True)
class Estimate:
    """What is believed at one time."""

    stamp_ns: int
    state: RigidBodyState
    pose_covariance: np.ndarray  # (3, 3) of x [m], y [m] and yaw [rad]
    motion_covariance: np.ndarray  # (3, 3) of the velocity in the world [m/s] and the turn rate [rad/s]


@dataclass(slots=True)
class _Event:
    """Something that was seen, and what was believed after it."""

    stamp_ns: int
    pose: np.ndarray | None  # (x, y, yaw); None for an inertial reading
    force: np.ndarray | None = None  # level, (2,)
    turn_rate: float = 0.0
    after: Snapshot | None = None

    @property
    def key(self) -> tuple[int, bool]:
        """Order: by time, and of one time the inertial reading first, which moves the robot there."""
        return self.stamp_ns, self.pose is not None


class Estimator:
    """Not thread-safe; the caller holds a lock.

    Attributes:
        outliers: Poses that were not believed.
        epoch: How often it had to begin anew.
        problem: Why there is no estimate; empty if there is one.
    """

    def __init__(self, settings: EstimatorSettings, limits: Limits) -> None:
        """Begin without an estimate.

        Args:
            settings: What to believe of the sensors.
            limits: What the robot can possibly do.
        """
        self._settings, self._limits = settings, limits
        self.outliers, self.epoch = 0, 0
        self._filter: MotionFilter | None = None
        self._history: list[_Event] = []
        self._pose_ns: int | None = None
        self._imu_ns: int | None = None
        self._strangers: list[tuple[int, np.ndarray]] = []
        self._forget()

    def see_pose(self, position: np.ndarray, quat_xyzw: np.ndarray, stamp_ns: int) -> str:
        """Take a pose in.

        Args:
            position: In the world, shape (3,) [m].
            quat_xyzw: Attitude, shape (4,).
            stamp_ns: As the source stamped it; the latency of the settings is taken off here [ns].

        Returns:
            Why it is not believed; empty if it is.
        """
        captured = stamp_ns - round(1e9 * self._settings.latency_s)
        problem = _pose_problem(position, quat_xyzw) or self._time_problem(captured, self._pose_ns, "pose")
        if problem:
            return problem
        quat = quat_xyzw / np.linalg.norm(quat_xyzw)
        pose = np.array([position[0], position[1], float(yaw_of(quat))])
        tilt = multiply(from_yaw(-pose[2]), quat)
        self._pose_ns = captured
        if self._filter is None:
            self._begin(captured, pose)
        elif not self._believe(captured, pose):
            return f"pose lies beyond the gate: {self.outliers} outliers so far"
        self._height, self._tilt, self._believed_ns = float(position[2]), tilt, captured
        return ""

    def see_imu(self, sample: ImuSample, stamp_ns: int) -> str:
        """Take an inertial reading in the body's frame, measured at a stamp [ns].

        Returns:
            Why it is not believed; empty if it is.
        """
        if not (np.isfinite(sample.specific_force).all() and np.isfinite(sample.angular_velocity).all()):
            return "inertial reading holds a value that is not finite"
        if abs(float(sample.angular_velocity[2])) > 2.0 * self._limits.yaw_rate:
            return f"turn rate {float(sample.angular_velocity[2]):.1f} rad/s is beyond the possible"
        problem = self._time_problem(stamp_ns, self._imu_ns, "inertial reading")
        if problem:
            return problem
        self._imu_ns = stamp_ns
        if self._filter is not None:
            level = rotate(self._tilt, sample.specific_force) - np.array([0.0, 0.0, GRAVITY])
            self._insert(_Event(stamp_ns, None, level[:2], float(sample.angular_velocity[2])))
        return ""

    def estimate(self) -> Estimate | None:
        """What is believed at the newest time that anything was seen of; None, with `problem`, if it is stale."""
        self.problem = self._staleness()
        if self.problem or self._filter is None:
            return None
        x, P = self._filter.x, self._filter.P
        state = RigidBodyState(
            np.array([x[X], x[Y], self._height]),
            np.asarray(multiply(from_yaw(np.asarray(x[YAW])), self._tilt)),
            np.array([x[VX], x[VY], 0.0]),
            np.array([0.0, 0.0, x[RATE]]),
        )
        return Estimate(self._history[-1].stamp_ns, state, P[np.ix_(POSE, POSE)], P[np.ix_(MOTION, MOTION)])

    def _staleness(self) -> str:
        if self._filter is None:
            return "no pose yet. Is the motion capture running, and does it see the robot?"
        gap_s = (self._history[-1].stamp_ns - self._believed_ns) / 1e9
        if gap_s > self._settings.bridge_s:
            return f"no believable pose for {gap_s:.2f} s (limit {self._settings.bridge_s:g} s)"
        if max(self._filter.P[VX, VX], self._filter.P[VY, VY]) > KNOWN_SPEED_STD**2:
            return "the velocity is not known well enough yet"
        return ""

    def _forget(self) -> None:
        self._filter = None
        self._history = []
        self._pose_ns = self._imu_ns = None
        self._believed_ns = 0
        self._height, self._tilt = 0.0, np.array([0.0, 0.0, 0.0, 1.0])
        self._strangers = []
        self.problem = "no pose yet. Is the motion capture running, and does it see the robot?"

    def _begin(self, stamp_ns: int, pose: np.ndarray) -> None:
        self._filter = MotionFilter(self._settings, pose)
        self._history = [_Event(stamp_ns, pose, after=self._filter.snapshot())]
        self._strangers = []

    def _time_problem(self, stamp_ns: int, last_ns: int | None, what: str) -> str:
        """Reject old stamps; a jump of time is reported once and begins anew."""
        if last_ns is None:
            return ""
        ahead = stamp_ns - last_ns
        if not -BACK_NS <= ahead <= FORWARD_NS:
            self._forget()
            self.epoch += 1
            return f"time of the {what} jumped by {ahead / 1e9:+.1f} s: a new epoch begins"
        return "" if ahead > 0 else f"stamp of the {what} did not advance"

    def _believe(self, stamp_ns: int, pose: np.ndarray) -> bool:
        """Insert a pose if it is no outlier."""
        assert self._filter is not None
        at = bisect.bisect_right(self._history, (stamp_ns, True), key=lambda event: event.key)
        if at == 0:
            return True  # captured before everything that is remembered: too late to matter, but no lie
        self._rewind(at)
        self._move_on(at, stamp_ns)
        if self._filter.distance2(pose) <= self._settings.gate:
            self._strangers = []
            self._insert(_Event(stamp_ns, pose))
            return True
        self.outliers += 1
        self._replay(at)
        return self._meet_stranger(stamp_ns, pose)

    def _meet_stranger(self, stamp_ns: int, pose: np.ndarray) -> bool:
        """Begin anew where outliers agree with one another for long enough."""
        if self._strangers:
            last_ns, last = self._strangers[-1]
            seconds = (stamp_ns - last_ns) / 1e9
            slack = 10.0 * self._settings.position_std
            apart = math.dist(pose[:2], last[:2])
            if apart > self._limits.speed * seconds + slack:
                self._strangers = []
        self._strangers.append((stamp_ns, pose))
        if len(self._strangers) < TO_BEGIN_ANEW:
            return False
        self._begin(stamp_ns, pose)
        self.epoch += 1
        return True

    def _insert(self, event: _Event) -> None:
        at = bisect.bisect_right(self._history, event.key, key=lambda past: past.key)
        if at == 0:
            return
        self._history.insert(at, event)
        self._replay(at)
        oldest = self._history[-1].stamp_ns - KEPT_NS
        while self._history[0].stamp_ns < oldest and len(self._history) > 1:
            del self._history[0]

    def _rewind(self, at: int) -> None:
        """Believe what was believed before event number `at`."""
        assert self._filter is not None
        before = self._history[at - 1].after
        assert before is not None
        self._filter.restore(before)

    def _replay(self, at: int) -> None:
        """Do event number `at` and everything after it, once more."""
        assert self._filter is not None
        self._rewind(at)
        for number in range(at, len(self._history)):
            event = self._history[number]
            self._move_on(number, event.stamp_ns)
            if event.pose is not None:
                self._filter.see_pose(event.pose)
            else:
                self._filter.see_turn_rate(event.turn_rate)
            event.after = self._filter.snapshot()

    def _move_on(self, at: int, stamp_ns: int) -> None:
        """Predict from the event before number `at` to a time, by the reading that stands for that time."""
        assert self._filter is not None
        seconds = (stamp_ns - self._history[at - 1].stamp_ns) / 1e9
        self._filter.move_on(seconds, self._force_for(at, stamp_ns))

    def _force_for(self, at: int, stamp_ns: int) -> np.ndarray | None:
        """The first reading at or after the end of the span, else the last before it, if it is near enough."""
        later = (event for event in self._history[at : at + 3] if event.force is not None)
        earlier = (event for event in self._history[max(0, at - 20) : at][::-1] if event.force is not None)
        for event in (*later, *earlier):
            if abs(event.stamp_ns - stamp_ns) <= READING_LASTS_NS:
                return event.force
        return None


def _pose_problem(position: np.ndarray, quat_xyzw: np.ndarray) -> str:
    if not (np.isfinite(position).all() and np.isfinite(quat_xyzw).all()):
        return "pose holds a value that is not finite"
    norm = float(np.linalg.norm(quat_xyzw))
    return "" if abs(norm - 1.0) <= 0.01 else f"quaternion of the pose has norm {norm:.3f}, must be 1"
