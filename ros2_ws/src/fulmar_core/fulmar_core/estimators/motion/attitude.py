"""Attitude and turn rate of a satellite, from star tracker, gyroscope, wheels and the rate of an event camera.

Readings: `star_tracker` is the attitude of the body in the world, a quaternion x, y, z, w, with its covariance about
the body's axes, shape (3, 3) [rad²]; `imu` an `ImuSample`; `wheels` a `WheelSpeeds`; `rate` a turn rate in the body,
shape (3,) [rad/s], with its covariance (3, 3). The estimate is a `RigidBodyState` that stays at the origin; its
covariance, shape (12, 12), is as in `SpatialMotionEstimator`, of which place and velocity are known.

A multiplicative extended Kalman filter (Markley and Crassidis, Fundamentals of Spacecraft Attitude Determination and
Control, 2014, §6.2) whose turn rate is a state of its own: Euler's equation with the measured speeds of the wheels
moves it, and a gyroscope measures it, as long as it lives. So the filter goes on without one.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from functools import lru_cache, partial
from typing import Any

import numpy as np

from fulmar_core.estimators.motion.estimator import LACKS_NOTHING, Estimate
from fulmar_core.estimators.motion.reading_times import ReadingTimes
from fulmar_core.estimators.motion.satellite_repeats import STAR_TRACKER, SatelliteRepeats
from fulmar_core.estimators.motion.settings import AttitudeSettings
from fulmar_core.estimators.motion.tracker_trust import TrackerTrust
from fulmar_core.robots.actuators.reaction_wheels import ReactionWheels
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.sensors.imu import NO_GYROSCOPE
from fulmar_core.states.attitude import exponential, normalised, product, rotation_error
from fulmar_core.states.rotation import cross, rotate
from fulmar_core.states.state import RigidBodyState
from fulmar_core.wires.reading import Reading

TURN, RATE, BIAS = slice(0, 3), slice(3, 6), slice(6, 9)  # of the errors
ERRORS = 9
_ONE, _SAME = np.eye(3), np.eye(ERRORS)
KEPT_NS = 2_000_000_000  # how late a reading may come
LATE_SHARE = 0.1  # of what a rate changed since its reading: how far the reading may be off by that
GATE = 16.3  # 1 good reading of 1,000 lies beyond it: chi-squared, 3 degrees of freedom
RATE_STD = 0.05  # of the turn rate when the filter begins [rad/s]
BIAS_STD = 1e-4  # of the gyroscope's bias when the filter begins [rad/s]
SPIN_GAP_NS = 500_000_000  # between readings of the wheels: after a longer one their torque is not known [ns]
RATE_NAMES = {"gyroscope": "gyroscope", "events": "event cameras", "wheels": "wheels"}  # for people
NO_ATTITUDE = "no attitude yet. Does the star tracker see stars?"


class AttitudeEstimator:
    """See `estimators.motion.estimator.Estimator`."""

    def __init__(self, settings: AttitudeSettings, robot: Robot) -> None:
        """Begin without an estimate."""
        self._settings, self._wheels, self._limits = settings, robot.actuated_by(ReactionWheels), robot.limits
        self._inertia = robot.body.inertia_matrix
        self._lightness = np.linalg.inv(self._inertia)
        self._names = self._wheels.wheel_names
        self._gyroscope_range = robot.sensors.imu.gyroscope_range
        self._sensors, self._tick_s = robot.sensors, robot.timing.physics_dt
        self.reset()

    def reset(self) -> None:
        """See `Estimator.reset`."""
        self.outliers, self.epoch = 0, 0
        self._forget()

    def _forget(self) -> None:
        self.problem = NO_ATTITUDE
        self._begun = False
        self._stamp_ns = 0
        self._times = ReadingTimes(self._begin_epoch)
        self._lacks = ""  # whether the inertial unit says that it has no gyroscope
        self._blind = False  # whether the newest speeds of the wheels are no measurement
        self._momentum: np.ndarray | None = None  # of the wheels, in the body [N·m·s]
        self._held: list[
            tuple[int, Callable[[int], str]]
        ] = []  # readings until the wheels' of that time come
        # Stamps [ns], attitudes and turn rates before now, oldest first.
        self._past: deque[tuple[int, np.ndarray, np.ndarray]] = deque()
        self._trust = TrackerTrust(self._settings.gyroscope_drift)
        self._repeats = SatelliteRepeats(self._sensors, self._names, tick_s=self._tick_s)
        self._attitudes = 0  # that were believed
        self._gyroscope_ns = self._rate_ns = self._attitude_ns = self._spin_ns = 0

    def _begin_epoch(self) -> None:
        self._forget()
        self.epoch += 1

    def take(self, name: str, reading: Reading) -> str | None:
        """See `Estimator.take`."""
        takers = {
            "star_tracker": self._attitude,
            "imu": self._gyroscope,
            "wheels": self._spin,
            "rate": self._rate,
        }
        if name not in takers:
            return f"reading '{name}' is not known here, only {', '.join(takers)}"
        if problem := self._times.problem(f"'{name}'", reading.stamp_ns):
            return problem
        assert reading.stamp_ns is not None  # as in `problem`
        return takers[name](reading, reading.stamp_ns) or None

    def estimate(self, stamp_ns: int | None = None) -> Estimate | None:
        """See `Estimator.estimate`."""
        if not self._begun:
            self.problem = NO_ATTITUDE
            return None
        now_ns = self._stamp_ns if stamp_ns is None else max(stamp_ns, self._stamp_ns)
        self._move_to(now_ns)
        self.problem = self._staleness(now_ns)
        if self.problem:
            return None
        state = RigidBodyState(np.zeros(3), self._quat.copy(), np.zeros(3), self._turning.copy())
        axes = rotate(self._quat, _ONE).T  # body to world
        covariance = np.zeros((12, 12))
        covariance[3:6, 3:6] = axes @ self._P[TURN, TURN] @ axes.T
        covariance[9:, 9:] = self._P[RATE, RATE]
        return Estimate(state, covariance, now_ns)

    @property
    def rate_source(self) -> str:
        """What the turn rate comes from now: `gyroscope`, `events` or `wheels`."""
        for name, newest_ns in (("gyroscope", self._gyroscope_ns), ("events", self._rate_ns)):
            if newest_ns and self._stamp_ns - newest_ns <= 1e9 * self._settings.bridge_s:
                return name
        return "wheels"

    def warnings(self) -> tuple[str, ...]:
        """See `Estimator.warnings`."""
        return tuple(filter(None, (self._trust.doubt, self._trust.warning, *self._repeats.frozen)))

    def status(self) -> dict[str, str]:
        """See `Estimator.status`."""
        return {"rate_from": self.rate_source, "lacks": self._lacks or LACKS_NOTHING}

    def _staleness(self, now_ns: int) -> str:
        std = np.degrees(np.sqrt(np.diag(self._P)[:6].reshape(2, 3).max(axis=1)))
        if std[0] > self._settings.attitude_limit_deg:
            since_s = (now_ns - self._attitude_ns) / 1e9
            return f"the attitude is known to {std[0]:.2f}° only: no star tracker for {since_s:.0f} s"
        if self._trust.doubt:
            return self._trust.doubt
        if self._attitudes < 2 and STAR_TRACKER in self._repeats.frozen:
            return f"{STAR_TRACKER}, and no other attitude was ever seen"
        if std[1] > self._settings.rate_limit_deg:
            return f"the turn rate is known to {std[1]:.3f} °/s only: no gyroscope and no stars"
        return ""

    def _attitude(self, reading: Reading, stamp_ns: int) -> str:
        quat = np.asarray(reading.value, dtype=float)
        if not np.isfinite(quat).all() or abs(float(np.linalg.norm(quat)) - 1.0) > 0.01:
            return "the attitude is no unit quaternion of finite numbers"
        if repeated := self._repeats.see("star_tracker", quat, stamp_ns):
            return repeated
        quat = quat / np.linalg.norm(quat)
        noise = self._settings.star_tracker_std**2 * np.eye(3)
        if reading.covariance is not None and np.asarray(reading.covariance).any():
            noise = np.asarray(reading.covariance)
        if not self._begun:
            self._begin(quat, noise, stamp_ns)
            return ""
        return self._with_wheels(stamp_ns, partial(self._use_attitude, quat, noise))

    def _use_attitude(self, quat: np.ndarray, noise: np.ndarray, stamp_ns: int) -> str:
        self._move_to(stamp_ns)
        believed = self._quat_at(stamp_ns)
        residual = np.array(rotation_error(tuple(believed), tuple(quat)))
        if not self._correct(residual, TURN, noise, gated=True):
            variance = float(np.linalg.eigvalsh(noise)[-1])
            source = self._rate_alone()
            if self._trust.stranger(believed, quat, variance, self._speed, stamp_ns, source):
                self._begin(quat, noise, stamp_ns)
                self.epoch += 1
                return ""
            return f"the attitude lies beyond the gate: {self.outliers} outliers so far"
        self._attitudes += 1
        self._attitude_ns = stamp_ns
        self._trust.match()
        if self.rate_source == "gyroscope":
            self._trust.see_bias(self._bias, self._P[BIAS, BIAS], self._speed, stamp_ns)
        return ""

    @property
    def _speed(self) -> float:
        """Size of the turn rate [rad/s]."""
        return float(np.linalg.norm(self._turning))

    def _rate_alone(self) -> str:
        """What the turn rate comes from, for people; empty where gyroscope and event cameras agree on it."""
        source = self.rate_source
        seen = self._rate_ns and self._stamp_ns - self._rate_ns <= 1e9 * self._settings.bridge_s
        return "" if source == "gyroscope" and seen else RATE_NAMES[source]

    def _begin(self, quat: np.ndarray, noise: np.ndarray, stamp_ns: int) -> None:
        self._quat, self._turning, self._bias = quat, np.zeros(3), np.zeros(3)
        self._P = np.zeros((ERRORS, ERRORS))
        self._P[TURN, TURN] = noise
        self._P[RATE, RATE], self._P[BIAS, BIAS] = RATE_STD**2 * np.eye(3), BIAS_STD**2 * np.eye(3)
        self._stamp_ns = self._attitude_ns = stamp_ns
        self._begun = True
        self._attitudes += 1
        self._past.clear()

    def _gyroscope(self, reading: Reading, stamp_ns: int) -> str:
        self._lacks = "" if reading.value.has_rate else "gyroscope"
        if self._lacks:
            return NO_GYROSCOPE
        rate = np.asarray(reading.value.angular_velocity, dtype=float)
        if not np.isfinite(rate).all():
            return "the gyroscope reports a value that is not finite"
        largest = float(np.abs(rate).max())
        if largest >= self._gyroscope_range or largest > 2.0 * self._limits.yaw_rate:
            return f"the gyroscope reads {largest:.2f} rad/s, beyond what is possible"
        if repeated := self._repeats.see("imu", rate, stamp_ns):
            return repeated
        if not self._begun:
            return ""
        return self._with_wheels(stamp_ns, partial(self._use_gyroscope, rate))

    def _use_gyroscope(self, rate: np.ndarray, stamp_ns: int) -> str:
        self._move_to(stamp_ns)
        noise = self._settings.gyroscope_std**2 * _ONE
        self._correct(rate - self._turning - self._bias, (RATE, BIAS), noise, gated=False)
        self._gyroscope_ns = stamp_ns
        return ""

    def _rate(self, reading: Reading, stamp_ns: int) -> str:
        rate = np.asarray(reading.value, dtype=float)
        if not np.isfinite(rate).all() or reading.covariance is None:
            return "the rate is not finite, or has no covariance"
        if repeated := self._repeats.see("rate", rate, stamp_ns):
            return repeated
        if not self._begun:
            return ""
        return self._with_wheels(stamp_ns, partial(self._use_rate, rate, np.asarray(reading.covariance)))

    def _use_rate(self, rate: np.ndarray, covariance: np.ndarray, stamp_ns: int) -> str:
        self._move_to(stamp_ns)
        believed = self._rate_at(stamp_ns)
        change = LATE_SHARE * (
            self._turning - believed
        )  # a window of events shows the mean of a rate that changes
        late_s = (self._stamp_ns - stamp_ns) / 1e9
        noise = covariance + self._settings.rate_spread**2 * late_s * np.eye(3) + np.outer(change, change)
        if not self._correct(rate - believed, RATE, noise, gated=True):
            return f"the rate lies beyond the gate: {self.outliers} outliers so far"
        self._rate_ns = stamp_ns
        return ""

    def _with_wheels(self, stamp_ns: int, use: Callable[[int], str]) -> str:
        """Use a reading now, or once the wheels' of its time came: unknown torque would look like noise."""
        self._held.append((stamp_ns, use))
        self._held.sort(key=lambda one: one[0])
        silent = self._blind or self._held[-1][0] > self._spin_ns + SPIN_GAP_NS
        problems = []
        while self._held and (silent or self._held[0][0] <= self._spin_ns):
            held_ns, use = self._held.pop(0)
            problems.append(use(held_ns))
        return "; ".join(filter(None, problems))

    def _release(self, problem: str) -> str:
        """Use what waited for the wheels, since these say nothing; returns why of them and of it nothing was used."""
        waiting, self._held = self._held, []
        return "; ".join(filter(None, (problem, *(use(held_ns) for held_ns, use in waiting))))

    def _spin(self, reading: Reading, stamp_ns: int) -> str:
        speeds = dict(zip(reading.value.names, np.asarray(reading.value.speeds, dtype=float), strict=False))
        if not set(self._names) <= set(speeds):
            return f"wheels {', '.join(sorted(set(self._names) - set(speeds)))} are missing"
        each = np.array([speeds[name] for name in self._names])
        if not np.isfinite(each).all():
            return "a wheel reports a speed that is not finite"
        was_blind, repeated = self._blind, self._repeats.see_wheels(each, stamp_ns)
        self._blind = bool(repeated)  # from now on the torque of the wheels is not known
        if self._blind:
            return self._release(repeated)
        momentum = self._wheels.to_body(self._wheels.spin_inertia * each)
        before, before_ns = self._momentum, self._spin_ns
        self._momentum, self._spin_ns = momentum, stamp_ns
        if not self._begun or before is None or was_blind or stamp_ns - before_ns > SPIN_GAP_NS:
            return ""  # of a longer change the gyroscope has shown its part already
        meanwhile = [one for one in self._held if one[0] <= stamp_ns]
        self._held = self._held[len(meanwhile) :]
        change, done_ns, problems = momentum - before, before_ns, []
        for until_ns, use in (*meanwhile, (stamp_ns, None)):
            if until_ns > done_ns:
                self._move_to(until_ns)
                share = (until_ns - done_ns) / (stamp_ns - before_ns)
                self._lose(self._lightness @ (share * change), (until_ns - done_ns) / 1e9)
                done_ns = until_ns
            problems.append(use(until_ns) if use else "")
        return "; ".join(filter(None, problems))

    def _lose(self, lost: np.ndarray, passed_s: float) -> None:
        """Take from the turn rate what the wheels took since their last reading, evenly over that time [rad/s, s].

        As far as the inertia is known; the noise of their speeds comes with it.
        """
        half_s = 0.5 * min(passed_s, SPIN_GAP_NS / 1e9)
        self._turning = self._turning - lost
        turned = exponential(tuple((-half_s * lost).tolist()))
        self._quat = np.asarray(normalised(product(tuple(self._quat.tolist()), turned)))
        spread = self._settings.wheel_std * self._wheels.spin_inertia
        noise = 2.0 * spread**2 * self._lightness @ self._lightness.T
        noise = noise + self._settings.inertia_share**2 * np.outer(lost, lost)
        self._P = self._P.copy()
        self._P[RATE, RATE] += noise
        self._P[TURN, RATE] += half_s * noise
        self._P[RATE, TURN] += half_s * noise
        self._P[TURN, TURN] += half_s**2 * noise

    def _move_to(self, stamp_ns: int) -> None:
        """Predict to a time; one before the newest moves nothing [ns]."""
        t = (stamp_ns - self._stamp_ns) / 1e9
        if t <= 0.0:
            return
        self._past.append((self._stamp_ns, self._quat, self._turning))
        momentum = np.zeros(3) if self._momentum is None else self._momentum
        rate = self._turning
        gyroscopic = -self._lightness @ cross(rate, self._inertia @ rate + momentum)
        after = rate + t * gyroscopic
        turned = exponential(tuple((0.5 * t * (rate + after)).tolist()))
        self._quat = np.asarray(normalised(product(tuple(self._quat.tolist()), turned)))
        self._turning = after
        F = _SAME.copy()
        F[TURN, TURN] = rotate(np.asarray(turned), _ONE)  # of the inverse rotation: rows are turned axes
        F[TURN, RATE] = t * _ONE
        measured = stamp_ns <= self._spin_ns + (0 if self._blind else SPIN_GAP_NS)
        self._P = F @ self._P @ F.T + _noise(self._settings, t, measured=measured)
        self._stamp_ns = stamp_ns
        while self._past and self._past[0][0] < stamp_ns - KEPT_NS:
            self._past.popleft()

    def _quat_at(self, stamp_ns: int) -> np.ndarray:
        """Attitude that was believed at a time not long ago [ns]."""
        if not self._past or stamp_ns >= self._stamp_ns:
            return self._quat
        _, quat, _ = min(self._past, key=lambda one: abs(one[0] - stamp_ns))
        return quat

    def _rate_at(self, stamp_ns: int) -> np.ndarray:
        """Turn rate that was believed at a time not long ago [ns]."""
        if not self._past or stamp_ns >= self._stamp_ns:
            return self._turning
        rates = [*self._past, (self._stamp_ns, self._quat, self._turning)]
        stamps = [one[0] for one in rates]
        return np.array([np.interp(stamp_ns, stamps, [one[2][axis] for one in rates]) for axis in range(3)])

    def _correct(self, residual: np.ndarray, part: Any, noise: np.ndarray, *, gated: bool) -> bool:
        """Correct by a residual of one part of the errors, or of the sum of several; whether it passed the gate."""
        H = _rows(*(each.start for each in (part if isinstance(part, tuple) else (part,))))
        spread = H @ self._P @ H.T + noise
        if gated and float(residual @ np.linalg.solve(spread, residual)) > GATE:
            self.outliers += 1
            return False
        gain = np.linalg.solve(spread, H @ self._P).T
        error = gain @ residual
        left = _SAME - gain @ H
        self._P = left @ self._P @ left.T + gain @ noise @ gain.T  # Joseph's form stays symmetric
        turned = exponential(tuple(error[TURN].tolist()))
        self._quat = np.asarray(normalised(product(tuple(self._quat.tolist()), turned)))
        self._turning, self._bias = self._turning + error[RATE], self._bias + error[BIAS]
        return True


@lru_cache(maxsize=64)
def _noise(s: AttitudeSettings, t: float, *, measured: bool) -> np.ndarray:
    """What noise adds to the covariance in a time [s]; `measured`: the wheels are. Not to be changed."""
    Q, spin = np.zeros((ERRORS, ERRORS)), (s.rate_spread if measured else s.rate_spread_blind) ** 2
    Q[TURN, TURN], Q[RATE, RATE] = spin * t**3 / 3.0 * _ONE, spin * t * _ONE
    Q[TURN, RATE] = Q[RATE, TURN] = spin * t * t / 2.0 * _ONE
    Q[BIAS, BIAS] = s.gyroscope_drift**2 * t * _ONE
    return Q


@lru_cache(maxsize=8)
def _rows(*starts: int) -> np.ndarray:
    """Derivative of the sum of parts of the errors that begin at some numbers, shape (3, 9). Not to be changed."""
    H = np.zeros((3, ERRORS))
    for start in starts:
        H[:, start : start + 3] = _ONE
    return H
