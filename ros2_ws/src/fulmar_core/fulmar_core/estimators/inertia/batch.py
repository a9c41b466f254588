"""Batch least squares of the inertia, with Huber's weights, on the balance of momentum over spans of time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fulmar_core.estimators.inertia.momentum_balance import cumulated

SPAN_S = 4.0  # over which momentum is balanced: torques change much in it, a gyroscope's bias little
HUBER = 1.345  # residuals beyond, in robust standard deviations, count less (Huber, Robust Statistics, 1981)
PASSES = 8  # of reweighting


@dataclass(frozen=True)
class Fit:
    """Least squares of some balances."""

    numbers: np.ndarray  # of the inertia, shape (count,) [kg·m²]
    covariance: np.ndarray  # of these, shape (count, count)
    information: np.ndarray  # per squared N·m·s of a residual, shape (count, count)
    residual_std: float  # robust [N·m·s]


def batch_fit(
    rate: np.ndarray, momentum: np.ndarray, times: np.ndarray, *, count: int, span_s: float = SPAN_S
) -> Fit:
    """Fit the inertia, and a torque from outside that stays the same in the body.

    Args:
        rate: Measured turn rates, shape (k, 3) [rad/s].
        momentum: Measured momentum of the wheels in the body frame, shape (k, 3) [N·m·s].
        times: Of the samples, shape (k,), evenly spaced [s].
        count: Numbers of the inertia, 3 or 6.
        span_s: Length of a balance [s].

    Raises:
        ValueError: There are fewer samples than two spans have.
    """
    step = float(np.median(np.diff(times)))
    span = max(1, round(span_s / step))
    if len(times) < 2 * span:
        raise ValueError(
            f"{len(times)} samples last {len(times) * step:g} s; at least {2 * span_s:g} s are needed."
        )
    left, right = cumulated(rate, momentum, times, count)
    rows = left[span:] - left[:-span]
    lasting = np.broadcast_to(-span_s * np.eye(3), (len(rows), 3, 3))
    rows = np.concatenate((rows, lasting), axis=-1).reshape(-1, count + 3)
    aim = (right[span:] - right[:-span]).reshape(-1)
    weights = np.ones(len(aim))
    for _ in range(PASSES):
        normal = rows.T @ (weights[:, None] * rows)
        found = np.linalg.lstsq(normal, rows.T @ (weights * aim), rcond=1e-14)[0]
        residual = np.abs(aim - rows @ found)
        std = max(1.4826 * float(np.median(residual)), 1e-15)
        weights = np.minimum(1.0, HUBER * std / np.maximum(residual, 1e-300))
    # Spans overlap: a sample is in as many as a span is long, which makes each balance worth less by as much.
    information = _without(normal, count) / span
    return Fit(found[:count], std**2 * np.linalg.pinv(information, hermitian=True), information, std)


def _without(normal: np.ndarray, count: int) -> np.ndarray:
    """Information of the first numbers where the others are not known (Schur's complement)."""
    a, b, c = normal[:count, :count], normal[:count, count:], normal[count:, count:]
    return np.asarray(a - b @ np.linalg.solve(c, b.T))
