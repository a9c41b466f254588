"""The motion that each pulse of an actuator adds to a robot that drifts, by least squares on its poses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

Motion = Literal["floating", "coasting", "rolling"]
DELAYS_S = np.arange(0.0, 0.31, 0.02)  # between a command and the motion in the poses; the best one is taken
LEAST_SIGMA = 1e-6  # of a change: poses without noise are no proof of an infinite signal [m/s, m, rad/s, rad]


@dataclass(frozen=True)
class Track:
    """Poses of a robot over time, each array of shape (n,)."""

    time_s: np.ndarray  # ascending [s]
    x: np.ndarray  # in the frame of the poses [m]
    y: np.ndarray  # [m]
    heading: np.ndarray  # without jumps [rad]
    rates: np.ndarray | None = (
        None  # of the three, shape (n, 3); None: poses alone are measured [m/s, m/s, rad/s]
    )


@dataclass(frozen=True)
class Pulse:
    """When an actuator worked, by the clock of the track."""

    begin_s: float
    end_s: float


@dataclass(frozen=True)
class Response:
    """What one pulse changed, in the body frame: ahead, to the left, and the heading, each of shape (3,).

    Velocities [m/s, m/s, rad/s] of a body that floats or coasts; distances [m, m, rad] of one that rolls.
    """

    change: np.ndarray
    sigma: np.ndarray  # standard error of each

    @property
    def clearly(self) -> np.ndarray:
        """Each change in units of its standard error, shape (3,)."""
        return np.asarray(np.abs(self.change) / self.sigma)


def responses(track: Track, pulses: Sequence[Pulse], motion: Motion) -> list[Response]:
    """Estimate the change of motion that each pulse caused.

    One least-squares fit for each axis over the whole track: a start, what moves by itself, and a step for each pulse.
    A floating body drifts and may be pushed by a constant force (a slope, a tether); a coasting one drifts; a rolling
    one stands between pulses.

    Args:
        track: Poses from before the first pulse until after the last, at least 8.
        pulses: In the order of time.
        motion: How the body moves when no actuator works.

    Returns:
        One response for each pulse.

    Raises:
        ValueError: The track has too few poses for the fit.
    """
    rates = track.rates if motion == "coasting" else None
    order = {"floating": 2, "coasting": 1, "rolling": 0}[motion]
    time_s = track.time_s - track.time_s[0]
    if len(time_s) < max(8, 2 * (order + 1 + len(pulses))):
        raise ValueError(f"{len(time_s)} poses are too few for {len(pulses)} pulses.")
    poses = np.stack((track.x, track.y, track.heading), axis=1)
    # Poses and rates count alike: a robot file's noise of both is of one size, in m and m/s, rad and rad/s.
    values = poses if rates is None else np.concatenate((poses, rates))
    powers = range(order + 1)
    fits = []
    for delay_s in DELAYS_S:
        steps = [
            _step(time_s, pulse.begin_s - track.time_s[0] + delay_s, pulse.end_s - pulse.begin_s, motion)
            for pulse in pulses
        ]
        basis = np.stack([*(time_s**power for power in powers), *(step for step, _ in steps)], axis=1)
        if rates is not None:
            rising = (power * time_s ** max(0, power - 1) for power in powers)
            basis = np.concatenate((basis, np.stack([*rising, *(rate for _, rate in steps)], axis=1)))
        solution = np.linalg.lstsq(basis, values, rcond=None)[0]
        square = np.mean((values - basis @ solution) ** 2, axis=0) + LEAST_SIGMA**2
        fits.append((float(np.log(square).sum()), delay_s, basis, solution, square))
    _, delay_s, basis, solution, square = min(fits, key=lambda fit: fit[0])
    spread = np.sqrt(np.diag(np.linalg.pinv(basis.T @ basis)))
    found = []
    for number, pulse in enumerate(pulses, start=order + 1):
        middle = 0.5 * (pulse.begin_s + pulse.end_s) + delay_s
        heading = float(np.interp(middle, track.time_s, track.heading))
        cos, sin = np.cos(heading), np.sin(heading)
        x, y, turn = solution[number]
        sigma = np.maximum(spread[number] * np.sqrt(square), LEAST_SIGMA)
        flat = float(np.hypot(sigma[0], sigma[1]) / np.sqrt(2.0))
        found.append(
            Response(np.array([cos * x + sin * y, cos * y - sin * x, turn]), np.array([flat, flat, sigma[2]]))
        )
    return found


def _step(
    time_s: np.ndarray, begin_s: float, lasts_s: float, motion: Motion
) -> tuple[np.ndarray, np.ndarray]:
    """Pose over time that a unit change makes, and its rate: a ramp up to 1 for what rolls, else its integral."""
    passed = np.clip(time_s - begin_s, 0.0, None)
    lasts_s = max(lasts_s, 1e-3)
    within = np.minimum(passed, lasts_s)
    ramp = within / lasts_s
    if motion == "rolling":
        return ramp, ((passed > 0.0) & (passed < lasts_s)) / lasts_s
    return 0.5 * within**2 / lasts_s + (passed - within), ramp
