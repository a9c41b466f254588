"""Balance of momentum over a span of time, linear in the inertia: the equation that the least squares solve.

In the body's frame d/dt (J ω + h) = −ω × (J ω + h) + τ, with h the momentum of the wheels relative to the body. Over a
span from a to b, with nothing differentiated that has noise:

    J (ω_b − ω_a) + ∫ ω × J ω dt = −(h_b − h_a) − ∫ ω × h dt + ∫ τ dt

Integrals are exact for turn rates and momenta that change linearly between samples, as they do under held torques.
"""

from __future__ import annotations

import numpy as np

DIAGONAL, FULL = 3, 6  # numbers of an inertia that is estimated: xx, yy, zz, and xy, xz, yz


def matrices(rate: np.ndarray, count: int) -> np.ndarray:
    """Matrices that times the inertia's numbers give J ω.

    Args:
        rate: ω, shape (..., 3) [rad/s].
        count: `DIAGONAL` or `FULL`.

    Returns:
        Shape (..., 3, count).
    """
    x, y, z = np.moveaxis(rate, -1, 0)
    o = np.zeros_like(x)
    rows = [[x, o, o, y, z, o], [o, y, o, x, o, z], [o, o, z, o, x, y]]
    return np.moveaxis(np.array([row[:count] for row in rows]), (0, 1), (-2, -1))


def crossed(rate: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """ω × each column, shapes (..., 3) and (..., 3, m) to (..., 3, m)."""
    return np.cross(rate[..., None], columns, axisa=-2, axisb=-2, axisc=-2)


def cumulated(
    rate: np.ndarray, momentum: np.ndarray, times: np.ndarray, count: int
) -> tuple[np.ndarray, np.ndarray]:
    """Both sides of the balance, from the first sample on.

    Args:
        rate: Turn rates, shape (k, 3) [rad/s].
        momentum: Of the wheels in the body frame, shape (k, 3) [N·m·s].
        times: Of the samples, shape (k,) [s].
        count: Numbers of the inertia.

    Returns:
        Regressors, shape (k, 3, count), and what they equal, shape (k, 3) [N·m·s]; spans are differences of rows.
    """
    carried = matrices(rate, count)
    step = np.diff(times)[:, None, None]
    left = np.zeros_like(carried)
    left[1:] = np.cumsum(step * _product(rate, carried), axis=0)
    right = np.zeros_like(momentum)
    right[1:] = np.cumsum((step * _product(rate, momentum[..., None]))[..., 0], axis=0)
    return carried + left, -momentum - right


def _product(rate: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """Mean of ω × columns between samples, of which both change linearly, shape (k - 1, 3, m)."""
    whole = crossed(rate, columns)
    bend = crossed(np.diff(rate, axis=0), np.diff(columns, axis=0))
    return np.asarray(0.5 * (whole[1:] + whole[:-1]) - bend / 6.0)


def tensor_of(numbers: np.ndarray) -> np.ndarray:
    """Inertia tensor of its three or six numbers, shape (3, 3) [kg·m²]."""
    xx, yy, zz, xy, xz, yz = np.append(numbers, np.zeros(FULL - len(numbers)))
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def numbers_of(tensor: np.ndarray, count: int) -> np.ndarray:
    """The inverse of `tensor_of`, shape (count,)."""
    every = tensor[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    return np.asarray(every[:count])


def is_body(tensor: np.ndarray) -> bool:
    """Whether a body can have an inertia tensor: positive, and no principal moment beyond the sum of the others."""
    if not np.isfinite(tensor).all():
        return False
    moments = np.linalg.eigvalsh(tensor)
    return bool(moments[0] > 0.0 and 2.0 * moments[2] <= moments.sum() * (1.0 + 1e-6))
