"""Motion in the plane, from poses, inertial readings and star tracker attitudes in any order of arrival.

A pose is as old as its capture, and inertial readings have come since: the filter goes back to the time of capture,
takes the pose in, and repeats what came after it.

Readings: `mocap` is a pose in the world, shape (7,): position [m], quaternion x, y, z, w. `imu` is an `ImuSample` in
the body's frame. `star_tracker` is the attitude of the body in the world, a quaternion x, y, z, w; its covariance is
about the body's axes, shape (3, 3) [rad²]. The estimate is a `RigidBodyState`; its covariance, shape (12, 12), is about
position and rotation in the world [m, rad], then velocity in the world [m/s] and turn rate in the body [rad/s].
"""

from __future__ import annotations

import bisect
import math
from dataclasses import dataclass

import numpy as np

from fulmar_core.dynamics.hydrodynamics import GRAVITY
from fulmar_core.estimation.estimator import Estimate
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
from fulmar_core.estimation.settings import PlanarMotionSettings
from fulmar_core.robot import Limits
from fulmar_core.rotation import from_yaw, multiply, rotate, yaw_of
from fulmar_core.safety.input_gate import BACK_NS, FORWARD_NS
from fulmar_core.sensors.reading import Reading
from fulmar_core.state import RigidBodyState

KEPT_NS = 1_000_000_000  # how far back an estimate can be corrected
READING_LASTS_NS = 60_000_000  # how long after it an inertial reading still stands for what happens
TO_BEGIN_ANEW = 10  # outliers in a row that agree with one another: then it is the estimate that is wrong
KNOWN_SPEED_STD = 0.15  # velocity must be known so well before an estimate is published [m/s]


IMU, POSE_SEEN, HEADING = range(
    3
)  # kinds of events; of one time the inertial reading first, which moves the robot there
PLANAR = np.array((0, 1, 5, 6, 7, 11))  # rows of a covariance that a motion in the plane has


@dataclass(slots=True)
class _Event:
    """Something that was measured, and what was believed after it."""

    stamp_ns: int
    kind: int
    pose: np.ndarray | None = None  # (x, y, yaw) of a pose
    yaw: float = 0.0  # of a heading [rad]
    yaw_std: float = 0.0  # of a heading [rad]
    force: np.ndarray | None = None  # level, (2,) of an inertial reading
    turn_rate: float = 0.0  # of an inertial reading
    after: Snapshot | None = None

    @property
    def key(self) -> tuple[int, int]:
        """Order: by time, then by kind."""
        return self.stamp_ns, self.kind


class PlanarMotionEstimator:
    """Extended Kalman filter with a history; see `Estimator`."""

    def __init__(self, settings: PlanarMotionSettings, limits: Limits) -> None:
        """Begin without an estimate.

        Args:
            settings: What to believe of the sensors.
            limits: What the robot can possibly do.
        """
        self._settings, self._limits = settings, limits
        self._takers = {"mocap": self._take_pose, "imu": self._take_imu, "star_tracker": self._take_attitude}
        self.reset()

    def reset(self) -> None:
        """See `Estimator`."""
        self.outliers, self.epoch = 0, 0
        self._forget()

    def take(self, name: str, reading: Reading) -> str | None:
        """See `Estimator`; the latency of the settings is taken off the stamps of poses here."""
        if name not in self._takers:
            return f"reading '{name}' is not known here, only {', '.join(self._takers)}"
        if reading.stamp_ns is None:
            return f"reading of '{name}' has no stamp"
        return self._takers[name](reading, reading.stamp_ns) or None

    def _take_pose(self, reading: Reading, stamp_ns: int) -> str:
        position, quat_xyzw = reading.value[:3], reading.value[3:]
        captured = stamp_ns - round(1e9 * self._settings.latency_s)
        problem = _pose_problem(position, quat_xyzw) or self._time_problem(captured, "pose")
        if problem:
            return problem
        quat = quat_xyzw / np.linalg.norm(quat_xyzw)
        pose = np.array([position[0], position[1], float(yaw_of(quat))])
        tilt = multiply(from_yaw(-pose[2]), quat)
        self._newest_ns["pose"] = captured
        if self._filter is None:
            self._begin(captured, pose)
        elif not self._believe(captured, pose):
            return f"pose lies beyond the gate: {self.outliers} outliers so far"
        self._height, self._tilt, self._believed_ns = float(position[2]), tilt, captured
        return ""

    def _take_imu(self, reading: Reading, stamp_ns: int) -> str:
        sample = reading.value
        if not (np.isfinite(sample.specific_force).all() and np.isfinite(sample.angular_velocity).all()):
            return "inertial reading holds a value that is not finite"
        if abs(float(sample.angular_velocity[2])) > 2.0 * self._limits.yaw_rate:
            return f"turn rate {float(sample.angular_velocity[2]):.1f} rad/s is beyond the possible"
        problem = self._time_problem(stamp_ns, "inertial reading")
        if problem:
            return problem
        self._newest_ns["inertial reading"] = stamp_ns
        if self._filter is not None:
            level = rotate(self._tilt, sample.specific_force) - np.array([0.0, 0.0, GRAVITY])
            turn_rate = float(sample.angular_velocity[2])
            self._insert(_Event(stamp_ns, IMU, force=level[:2], turn_rate=turn_rate))
        return ""

    def _take_attitude(self, reading: Reading, stamp_ns: int) -> str:
        """Correct the heading; an attitude before the first pose is of no use yet."""
        problem = _attitude_problem(reading.value, "attitude") or self._time_problem(stamp_ns, "attitude")
        if problem:
            return problem
        self._newest_ns["attitude"] = stamp_ns
        if self._filter is None:
            return ""
        std = self._settings.star_tracker_std
        if reading.covariance is not None:
            std = math.sqrt(float(reading.covariance[2, 2]))
        event = _Event(stamp_ns, HEADING, yaw=float(yaw_of(reading.value)), yaw_std=std)
        at = bisect.bisect_right(self._history, event.key, key=lambda past: past.key)
        if at == 0:
            return ""
        self._rewind(at)
        self._move_on(at, stamp_ns)
        if self._filter.heading_distance2(event.yaw, std) <= self._settings.gate:
            self._insert(event)
            return ""
        self.outliers += 1
        self._replay(at)
        return f"attitude lies beyond the gate: {self.outliers} outliers so far"

    def estimate(self, stamp_ns: int | None = None) -> Estimate | None:
        """See `Estimator`."""
        newest_ns = self._history[-1].stamp_ns if self._history else 0
        stamp_ns = newest_ns if stamp_ns is None else max(stamp_ns, newest_ns)
        self.problem = self._staleness(stamp_ns)
        if self.problem or self._filter is None:
            return None
        now = self._filter.snapshot()
        if stamp_ns > newest_ns:
            self._move_on(len(self._history), stamp_ns)
        x, P = self._filter.snapshot()
        self._filter.restore(now)
        state = RigidBodyState(
            np.array([x[X], x[Y], self._height]),
            np.asarray(multiply(from_yaw(np.asarray(x[YAW])), self._tilt)),
            np.array([x[VX], x[VY], 0.0]),
            np.array([0.0, 0.0, x[RATE]]),
        )
        covariance = np.zeros((12, 12))
        covariance[np.ix_(PLANAR, PLANAR)] = P[np.ix_((*POSE, *MOTION), (*POSE, *MOTION))]
        return Estimate(state, covariance, stamp_ns)

    def _staleness(self, stamp_ns: int) -> str:
        if self._filter is None:
            return "no pose yet. Is the motion capture running, and does it see the robot?"
        gap_s = (stamp_ns - self._believed_ns) / 1e9
        if gap_s > self._settings.bridge_s:
            return f"no believable pose for {gap_s:.2f} s (limit {self._settings.bridge_s:g} s)"
        if max(self._filter.P[VX, VX], self._filter.P[VY, VY]) > KNOWN_SPEED_STD**2:
            return "the velocity is not known well enough yet"
        return ""

    def _forget(self) -> None:
        self._filter: MotionFilter | None = None
        self._history: list[_Event] = []
        self._newest_ns: dict[str, int] = {}  # stamp of the newest reading, by what it is
        self._believed_ns = 0
        self._height, self._tilt = 0.0, np.array([0.0, 0.0, 0.0, 1.0])
        self._strangers: list[tuple[int, np.ndarray]] = []
        self.problem = "no pose yet. Is the motion capture running, and does it see the robot?"

    def _begin(self, stamp_ns: int, pose: np.ndarray) -> None:
        self._filter = MotionFilter(self._settings, pose)
        self._history = [_Event(stamp_ns, POSE_SEEN, pose, after=self._filter.snapshot())]
        self._strangers = []

    def _time_problem(self, stamp_ns: int, what: str) -> str:
        """Reject old stamps; a jump of time is reported once and begins anew."""
        last_ns = self._newest_ns.get(what)
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
        at = bisect.bisect_right(self._history, (stamp_ns, POSE_SEEN), key=lambda event: event.key)
        if at == 0:
            return True  # captured before everything that is remembered: too late to matter, but no lie
        self._rewind(at)
        self._move_on(at, stamp_ns)
        if self._filter.distance2(pose) <= self._settings.gate:
            self._strangers = []
            self._insert(_Event(stamp_ns, POSE_SEEN, pose))
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
            elif event.kind == HEADING:
                self._filter.see_heading(event.yaw, event.yaw_std)
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
    if not np.isfinite(position).all():
        return "pose holds a value that is not finite"
    return _attitude_problem(quat_xyzw, "pose")


def _attitude_problem(quat_xyzw: np.ndarray, what: str) -> str:
    if not np.isfinite(quat_xyzw).all():
        return f"{what} holds a value that is not finite"
    norm = float(np.linalg.norm(quat_xyzw))
    return "" if abs(norm - 1.0) <= 0.01 else f"quaternion of the {what} has norm {norm:.3f}, must be 1"
