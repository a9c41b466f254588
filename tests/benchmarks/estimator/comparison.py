"""Estimates at every tick of each method, and their errors."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import asdict, dataclass

import numpy as np

from fulmar_core.estimators.motion.planar_motion import PlanarMotionEstimator
from fulmar_core.estimators.motion.settings import PlanarMotionSettings
from fulmar_core.robots.robot import Limits
from fulmar_core.robots.sensors.imu import ImuSample
from fulmar_core.states.rotation import from_yaw
from fulmar_core.wires.reading import Reading
from tests.benchmarks.estimator.drive import TICK_S, Drive

POSES = 30


class ThirtyPoses:
    """The mean over a buffer."""

    def __init__(self) -> None:
        """Begin empty."""
        self._poses: deque[tuple[float, np.ndarray]] = deque(maxlen=POSES)

    def see_pose(self, time_s: float, pose: np.ndarray) -> None:
        """Note a pose (x [m], y [m], continuous yaw [rad]), captured at a time [s]."""
        self._poses.append((time_s, pose))

    def motion(self) -> np.ndarray | None:
        """Velocity in the world [m/s] and turn rate [rad/s], shape (3,); None before the buffer is full."""
        if len(self._poses) < POSES:
            return None
        (first_s, first), (last_s, last) = self._poses[0], self._poses[-1]
        mean_difference = (last - first) / (POSES - 1)
        return np.asarray(mean_difference / ((last_s - first_s) / POSES))


MEAN, POSES_ALONE, WITH_IMU = "mean of 30 poses", "Fulmar, poses alone", "Fulmar, poses and inertial unit"
SETTLE_S = 2.0  # before anything is evaluated: every method has its buffer full then
LONGEST_DELAY_S = 1.2
RATES_HZ = (200.0, 25.0)
DELAY_LIMIT_S, RMSE_SHARE_LIMIT = 0.020, 0.5  # what is required of the estimator, beside the mean


@dataclass(frozen=True)
class Figures:
    """How far one method is from the truth at the time of the estimate, over all drives."""

    pose_rate_hz: float
    method: str
    velocity_rmse_m_s: float
    yaw_rate_rmse_rad_s: float
    delay_ms: float  # by which the true velocity must be shifted to fit best
    gain_error: float  # of the velocity, once shifted: 0.034 is 3.4 % too fast [-]


def estimate_by_mean(drive: Drive, every: int, latency_s: float) -> np.ndarray:
    """Motion by the mean of 30 poses at each tick, shape (n, 3); NaN before the first."""
    method, late = ThirtyPoses(), round(latency_s / TICK_S)
    yaw = drive.measured_place.copy()
    yaw[:, 2] = np.unwrap(yaw[:, 2])
    estimates = np.full((len(drive.time_s), 3), np.nan)
    for tick in range(len(estimates)):
        captured = tick - late
        if captured >= 0 and captured % every == 0:
            method.see_pose(float(drive.time_s[captured]), yaw[captured])
        motion = method.motion()
        if motion is not None:
            estimates[tick] = motion
    return estimates


def estimate_by_filter(
    drive: Drive,
    every: int,
    latency_s: float,
    settings: PlanarMotionSettings,
    limits: Limits,
    *,
    with_imu: bool,
) -> np.ndarray:
    """Motion by the estimator at each tick, shape (n, 3); poses are stamped when they come, `latency_s` late."""
    estimator, late = PlanarMotionEstimator(settings, limits), round(latency_s / TICK_S)
    estimates = np.full((len(drive.time_s), 3), np.nan)
    newest = np.full(3, np.nan)
    for tick in range(len(estimates)):
        now_ns, captured, taken = round(1e9 * float(drive.time_s[tick])), tick - late, False
        if with_imu:
            sample = ImuSample(drive.force[tick], np.array([0.0, 0.0, drive.turn_rate[tick]]))
            taken = estimator.take("imu", Reading(sample, now_ns)) is None
        if captured >= 0 and captured % every == 0:
            x, y, yaw = drive.measured_place[captured]
            pose = np.array([x, y, 0.0, *from_yaw(np.asarray(yaw))])
            taken |= estimator.take("mocap", Reading(pose, now_ns)) is None
        estimate = estimator.estimate() if taken else None
        if estimate is not None:
            newest = np.array(
                [*estimate.value.velocity_in_world[:2], estimate.value.angular_velocity_in_body[2]]
            )
        estimates[tick] = newest
    return estimates


def estimate_by(
    method: str,
    drive: Drive,
    rate_hz: float,
    latency_s: float,
    settings: PlanarMotionSettings,
    limits: Limits,
) -> np.ndarray:
    """Motion of a drive by a method at each tick, with poses at a rate [Hz]; shape (n, 3)."""
    every = round(1.0 / (rate_hz * TICK_S))
    if method == MEAN:
        return estimate_by_mean(drive, every, latency_s)
    return estimate_by_filter(drive, every, latency_s, settings, limits, with_imu=method == WITH_IMU)


def compare(
    all_drives: list[Drive],
    settings: PlanarMotionSettings,
    limits: Limits,
    latency_s: float,
    progress: Callable[[], None],
) -> list[Figures]:
    """Every method at every rate, on the same drives."""
    found = []
    for rate_hz in RATES_HZ:
        for method in (MEAN, POSES_ALONE, WITH_IMU):
            estimates = [
                estimate_by(method, drive, rate_hz, latency_s, settings, limits) for drive in all_drives
            ]
            found.append(_figures(rate_hz, method, all_drives, estimates))
            progress()
    return found


def requirements_met(found: list[Figures]) -> list[dict[str, object]]:
    """What is required at each rate, and whether it was found."""
    lines: list[dict[str, object]] = []
    for rate_hz in RATES_HZ:
        at_rate = {row.method: row for row in found if row.pose_rate_hz == rate_hz}
        ours, mean = at_rate[WITH_IMU], at_rate[MEAN]
        share = ours.velocity_rmse_m_s / mean.velocity_rmse_m_s
        lines.append(
            {
                "pose_rate_hz": rate_hz,
                "rmse_share": share,
                "rmse_share_limit": RMSE_SHARE_LIMIT,
                "delay_ms": ours.delay_ms,
                "delay_limit_ms": 1e3 * DELAY_LIMIT_S,
                "passed": share <= RMSE_SHARE_LIMIT and abs(ours.delay_ms) < 1e3 * DELAY_LIMIT_S,
            }
        )
    return lines


def as_json(found: list[Figures]) -> list[dict[str, object]]:
    """The figures, ready for JSON."""
    return [asdict(row) for row in found]


def _figures(rate_hz: float, method: str, all_drives: list[Drive], estimates: list[np.ndarray]) -> Figures:
    begin = round((SETTLE_S + LONGEST_DELAY_S) / TICK_S)
    errors = np.concatenate(
        [one[begin:] - drive.motion[begin:] for one, drive in zip(estimates, all_drives, strict=True)]
    )
    shift, gain = _best_shift(all_drives, estimates, begin)
    return Figures(
        pose_rate_hz=rate_hz,
        method=method,
        velocity_rmse_m_s=float(np.sqrt(np.mean(np.sum(errors[:, :2] ** 2, axis=1)))),
        yaw_rate_rmse_rad_s=float(np.sqrt(np.mean(errors[:, 2] ** 2))),
        delay_ms=1e3 * shift * TICK_S,
        gain_error=gain - 1.0,
    )


def _best_shift(all_drives: list[Drive], estimates: list[np.ndarray], begin: int) -> tuple[float, float]:
    """Ticks by which the true velocity is shifted for the least squared error, with the best gain, and that gain.

    Found between ticks by a parabola through the three best.
    """
    estimated_velocity = np.concatenate([one[begin:, :2].ravel() for one in estimates])
    most = round(LONGEST_DELAY_S / TICK_S)
    least = -round(0.05 / TICK_S)
    costs, gains = [], []
    for shift in range(least, most + 1):
        true = np.concatenate([_shifted(drive.motion[:, :2], shift, begin).ravel() for drive in all_drives])
        gain = float(true @ estimated_velocity / (true @ true))
        costs.append(float(np.mean((estimated_velocity - gain * true) ** 2)))
        gains.append(gain)
    best = int(np.argmin(costs))
    if not 0 < best < len(costs) - 1:
        return float(least + best), gains[best]
    before, here, after = costs[best - 1 : best + 2]
    curve = before - 2.0 * here + after
    return least + best + (0.5 * (before - after) / curve if curve > 0.0 else 0.0), gains[best]


def _shifted(values: np.ndarray, shift: int, begin: int) -> np.ndarray:
    """Rows from `begin` on, as they were `shift` ticks before; at the end, a shift ahead repeats the last."""
    rows = np.clip(np.arange(begin, len(values)) - shift, 0, len(values) - 1)
    return values[rows]
