"""Inertia of a satellite from its gyroscope and its wheels, as readings come.

Readings: `imu` is an `ImuSample`, `wheels` a `WheelSpeeds`; those of one time belong together. The estimate is the
inertia tensor about the centre of mass, wheels locked, shape (3, 3) [kg·m²]; its covariance, shape (6, 6), is of xx,
yy, zz, xy, xz, yz. An estimate that no body can have, or that is not known well enough, is withheld.
"""

from __future__ import annotations

from collections import deque

import numpy as np

from fulmar_core.estimators.inertia.batch import SPAN_S, batch_fit
from fulmar_core.estimators.inertia.ekf import EkfSettings, InertiaFilter
from fulmar_core.estimators.inertia.momentum_balance import FULL, is_body, numbers_of, tensor_of
from fulmar_core.estimators.inertia.recursive import RecursiveFit
from fulmar_core.estimators.motion.estimator import Estimate
from fulmar_core.estimators.motion.reading_times import ReadingTimes
from fulmar_core.estimators.motion.satellite_repeats import SatelliteRepeats
from fulmar_core.estimators.motion.settings import InertiaSettings
from fulmar_core.robots.actuators.reaction_wheels import ReactionWheels
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.sensors.imu import NO_GYROSCOPE
from fulmar_core.wires.reading import Reading

AXES = "xyz"
NOT_BEGUN = "no readings of gyroscope and wheels of one time yet"
MOST_SAMPLES = 6000  # that the batch keeps: ten minutes at 10 Hz


class InertiaEstimator:
    """See `estimators.motion.estimator.Estimator`.

    Attributes:
        saturated: Names of wheels that run at their top speed now.
    """

    def __init__(self, settings: InertiaSettings, robot: Robot) -> None:
        """Begin with the inertia of the robot's file as the guess of the recursive methods."""
        self._settings, self._wheels = settings, robot.actuated_by(ReactionWheels)
        self._guess = settings.guess * numbers_of(robot.body.inertia_matrix, settings.count)
        self._limit = 2.0 * robot.limits.yaw_rate
        self._sensors, self._tick_s = robot.sensors, robot.timing.physics_dt
        self.reset()

    def reset(self) -> None:
        """See `Estimator.reset`."""
        self.outliers, self.epoch = 0, 0
        self._forget()

    def _forget(self) -> None:
        s = self._settings
        self.problem = NOT_BEGUN
        self.saturated: tuple[str, ...] = ()
        self._lacking = ""  # what the newest reading of the inertial unit does not have, in words
        self._times = ReadingTimes(self._begin_epoch)
        self._repeats = SatelliteRepeats(self._sensors, self._wheels.wheel_names, tick_s=self._tick_s)
        self._waiting: dict[str, deque[tuple[int, np.ndarray]]] = {"imu": deque(), "wheels": deque()}
        self._samples: deque[tuple[float, np.ndarray, np.ndarray]] = deque(maxlen=MOST_SAMPLES)
        self._first_ns = self._last_ns = -1
        momentum_std = self._wheels.spin_inertia * s.wheel_std
        self._ekf = InertiaFilter(self._guess, EkfSettings(s.gyroscope_std, momentum_std, s.spread, s.walk))
        noise = np.sqrt(2.0) * max(momentum_std, s.gyroscope_std * float(self._guess[:3].max()))
        self._rls = RecursiveFit(self._guess, spread=s.spread, noise=noise, memory_s=s.memory_s)
        self._batch: tuple[int, np.ndarray, np.ndarray] | None = (
            None  # samples that it had, numbers, covariance
        )

    def _begin_epoch(self) -> None:
        self._forget()
        self.epoch += 1

    def take(self, name: str, reading: Reading) -> str | None:
        """See `Estimator.take`."""
        if name not in self._waiting:
            return f"reading '{name}' is not known here, only {', '.join(self._waiting)}"
        if problem := self._times.problem(f"'{name}'", reading.stamp_ns):
            return problem
        value, problem = self._rate_of(reading) if name == "imu" else self._momentum_of(reading)
        if problem:
            return problem
        self._waiting[name].append((reading.stamp_ns or 0, value))
        self._pair()
        return None

    def _rate_of(self, reading: Reading) -> tuple[np.ndarray, str]:
        self._lacking = "" if reading.value.has_rate else NO_GYROSCOPE
        if self._lacking:
            return np.zeros(3), self._lacking
        rate = np.asarray(reading.value.angular_velocity, dtype=float)
        if not np.isfinite(rate).all():
            return rate, "the gyroscope reports a value that is not finite"
        if float(np.abs(rate).max()) > self._limit:
            self.outliers += 1
            return rate, f"turn rate {float(np.abs(rate).max()):.1f} rad/s is beyond what is possible"
        return rate, self._repeats.see("imu", rate, reading.stamp_ns or 0)

    def _momentum_of(self, reading: Reading) -> tuple[np.ndarray, str]:
        speeds = dict(zip(reading.value.names, np.asarray(reading.value.speeds, dtype=float), strict=False))
        names = self._wheels.wheel_names
        if not set(names) <= set(speeds):
            return np.zeros(3), f"wheels {', '.join(sorted(set(names) - set(speeds)))} are missing"
        each = np.array([speeds[name] for name in names])
        if not np.isfinite(each).all():
            return each, "a wheel reports a speed that is not finite"
        top = 0.999 * self._wheels.top_speed
        self.saturated = tuple(name for name, speed in zip(names, each, strict=True) if abs(speed) >= top)
        momentum = self._wheels.to_body(self._wheels.spin_inertia * each)
        return momentum, self._repeats.see_wheels(each, reading.stamp_ns or 0)

    def _pair(self) -> None:
        """Use readings of one time, at most as often as the settings say."""
        rates, momenta = self._waiting["imu"], self._waiting["wheels"]
        while rates and momenta:
            apart = rates[0][0] - momenta[0][0]
            if abs(apart) > 0.25e9 * self._settings.every_s:
                (rates if apart < 0 else momenta).popleft()
                continue
            (stamp_ns, rate), (_, momentum) = rates.popleft(), momenta.popleft()
            if self._last_ns >= 0 and stamp_ns - self._last_ns < 0.99e9 * self._settings.every_s:
                continue
            self._first_ns = stamp_ns if self._first_ns < 0 else self._first_ns
            self._last_ns = stamp_ns
            time_s = (stamp_ns - self._first_ns) / 1e9
            if self._settings.method == "batch":
                self._samples.append((time_s, rate, momentum))
            else:
                (self._ekf if self._settings.method == "ekf" else self._rls).add(rate, momentum, time_s)

    def estimate(self, stamp_ns: int | None = None) -> Estimate | None:
        """See `Estimator.estimate`; the stamp is that of the newest readings."""
        if self._last_ns < 0:
            self.problem = self._lacking or NOT_BEGUN
            return None
        numbers, covariance = self._believed()
        self.problem = "; ".join(self._repeats.frozen) or self._problem_of(numbers, covariance)
        if self.problem:
            return None
        whole = np.zeros((FULL, FULL))
        count = len(numbers)
        whole[:count, :count] = covariance
        for i in range(count, FULL):  # what is not estimated is as uncertain as a guess
            whole[i, i] = (self._settings.spread * float(np.mean(numbers[:3]))) ** 2
        return Estimate(tensor_of(numbers), whole, self._last_ns)

    @property
    def is_diagonal(self) -> bool:
        """Whether products of inertia are not estimated."""
        return self._settings.tensor == "diagonal"

    def shares(self) -> np.ndarray:
        """Standard deviation of each moment, as a share of it, shape (3,); infinite before there is one."""
        numbers, covariance = self._believed()
        return np.asarray(
            np.sqrt(np.maximum(np.diag(covariance)[:3], 0.0)) / np.maximum(np.abs(numbers[:3]), 1e-12)
        )

    def warnings(self) -> tuple[str, ...]:
        """See `Estimator.warnings`."""
        return self._repeats.frozen

    def status(self) -> dict[str, str]:
        """Excitation and what cannot be observed, for people: a value for each axis and the wheels."""
        found = {}
        for axis, share in zip(AXES, self.shares(), strict=True):
            known = share <= self._settings.known_share
            percent = f"{100.0 * share:.2g} %"
            found[f"i_{axis}{axis}"] = percent if known else f"cannot be observed ({percent})"
        found["saturated"] = ", ".join(self.saturated) or "none"
        found["method"] = self._settings.method
        return found

    def _problem_of(self, numbers: np.ndarray, covariance: np.ndarray) -> str:
        shares = self.shares()
        unknown = [
            axis for axis, share in zip(AXES, shares, strict=True) if not share <= self._settings.known_share
        ]
        if unknown:
            saturated = f"; {', '.join(self.saturated)} at top speed" if self.saturated else ""
            return (
                f"the inertia about {', '.join(unknown)} cannot be observed: too little excitation{saturated}"
            )
        if not is_body(tensor_of(numbers)):
            return f"no body has the inertia {', '.join(f'{n:.4g}' for n in numbers)} kg·m²: withheld"
        return ""

    def _believed(self) -> tuple[np.ndarray, np.ndarray]:
        """Numbers and their covariance by the method of the settings."""
        method = self._settings.method
        if method != "batch":
            source = self._ekf if method == "ekf" else self._rls
            return source.numbers, source.covariance
        count = self._settings.count
        enough = 2.5 * SPAN_S / self._settings.every_s
        if len(self._samples) < enough:
            return self._guess, np.diag(np.full(count, np.inf))
        if (
            self._batch is None
            or len(self._samples) >= self._batch[0] + enough
            or len(self._samples) == MOST_SAMPLES
        ):
            times, rate, momentum = (np.array(part) for part in zip(*self._samples, strict=True))
            fit = batch_fit(rate, momentum, times, count=count)
            self._batch = len(self._samples), fit.numbers, fit.covariance
        return self._batch[1:]
