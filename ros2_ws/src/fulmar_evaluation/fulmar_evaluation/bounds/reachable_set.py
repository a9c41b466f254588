"""What a point mass can reach in a given time: one smooth inequality, with its derivatives.

A mass with |a| <= 1 (in its unit) needs, for a change of velocity Δv and of position Δp within h, that the pair
(Δv, q) lies in a convex set, where q = Δp - h v̄ and v̄ is the mean of first and last velocity: q is the moment of
the acceleration about the middle of the interval. The set's boundary is made by accelerations along η + λ s (the
bilinear tangent law: Bryson and Ho, "Applied Optimal Control"). Along Δv that gives the parabola
4|q| <= h² - |Δv|², and in all directions, with x = |Δv|² / h²,

    16 (|q|² - S(x) (Δv × q)² / h²) <= (h² - |Δv|²)²,   S(x) = 1 + (1 - x) (0.35 + 0.262 (1 - x) + 0.209 (1 - x)²).

The three numbers are fitted so that this set contains the true one: whatever flies is inside. Seen from the centre
it is 3 % larger on average, and 8 % in its worst direction.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_FIT = (0.35, 0.262, 0.209)


def reach_slack(
    velocity_change: np.ndarray, moment: np.ndarray, duration: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """How far inside the reachable set a change lies, >= 0 inside.

    Args:
        velocity_change: Δv, shape (2, ...), in units in which the largest acceleration is 1.
        moment: q, shape (2, ...).
        duration: h, shape (...,).

    Returns:
        h² - |Δv|², and the slack divided by it; inside where both are >= 0. Shapes (...,).
    """
    a, b, c = _invariants(velocity_change, moment)
    square = duration * duration
    room = square - a
    with np.errstate(divide="ignore", invalid="ignore"):
        e = 1.0 - a / square
        shape = 1.0 + e * (_FIT[0] + e * (_FIT[1] + e * _FIT[2]))
        return room, room - 16.0 * (b - c * c * shape / square) / room


@dataclass(frozen=True, slots=True)
class LogBarrier:
    """Value, gradient and curvature of -log(slack) in (Δv_x, Δv_y, q_x, q_y, h)."""

    gradient: np.ndarray  # (5, ...)
    hessian: np.ndarray  # (5, 5, ...)


def log_barrier(velocity_change: np.ndarray, moment: np.ndarray, duration: np.ndarray) -> LogBarrier:
    """Derivatives of -log of the slack; shapes as in `reach_slack`, which must be inside."""
    h = duration
    a, b, c = _invariants(velocity_change, moment)
    k = 1.0 / (h * h)
    x = a * k
    e = 1.0 - x
    f0, f1, f2 = _FIT
    # The shape S(x), its first two derivatives, and those of w = S / h² by a and h.
    S = 1.0 + e * (f0 + e * (f1 + e * f2))
    S1 = -(f0 + e * (2.0 * f1 + e * 3.0 * f2))
    S2 = 2.0 * f1 + e * 6.0 * f2
    w, w_a, w_aa = S * k, S1 * k * k, S2 * k * k * k
    w_h = -2.0 * k / h * (x * S1 + S)
    w_ah = -2.0 * k * k / h * (x * S2 + 2.0 * S1)
    w_hh = k * k * (6.0 * (x * S1 + S) + 4.0 * x * (x * S2 + 2.0 * S1))
    # N = 16 (b - c² w) and D = h² - a; the slack is s = D - N / D. Order of the variables: a, b, c, h.
    cc = 16.0 * c * c
    N = 16.0 * b - cc * w
    N1 = (-cc * w_a, 16.0, -32.0 * c * w, -cc * w_h)
    N2 = {
        (0, 0): -cc * w_aa,
        (0, 2): -32.0 * c * w_a,
        (0, 3): -cc * w_ah,
        (2, 2): -32.0 * w,
        (2, 3): -32.0 * c * w_h,
        (3, 3): -cc * w_hh,
    }
    r = 1.0 / (h * h - a)
    D1 = (-1.0, 0.0, 0.0, 2.0 * h)
    slack = 1.0 / r - N * r
    lift = 1.0 + N * r * r
    s1 = [D1[i] * lift - N1[i] * r for i in range(4)]
    s2 = {}
    for i in range(4):
        for j in range(i, 4):
            s2[i, j] = (D1[i] * N1[j] + D1[j] * N1[i]) * r * r - 2.0 * N * r**3 * D1[i] * D1[j]
            s2[i, j] = s2[i, j] - N2.get((i, j), 0.0) * r
    s2[3, 3] = s2[3, 3] + 2.0 * lift
    (v0, v1), (q0, q1) = velocity_change, moment
    # How a, b, c and h change with the five variables.
    rows = ({0: 2.0 * v0, 1: 2.0 * v1}, {2: 2.0 * q0, 3: 2.0 * q1}, {0: q1, 1: -q0, 2: -v1, 3: v0}, {4: 1.0})
    shape = np.shape(h)
    g, H = np.zeros((5, *shape)), np.zeros((5, 5, *shape))
    for i in range(4):
        for y, by_y in rows[i].items():
            g[y] += s1[i] * by_y
            for j in range(4):
                second = s2[min(i, j), max(i, j)]
                for z, by_z in rows[j].items():
                    if z >= y:
                        H[y, z] += second * (by_y * by_z)
    for y, first in ((0, s1[0]), (1, s1[0]), (2, s1[1]), (3, s1[1])):
        H[y, y] += 2.0 * first
    H[0, 3] += s1[2]
    H[1, 2] -= s1[2]
    g /= slack
    for y in range(5):
        for z in range(y, 5):
            H[y, z] = g[y] * g[z] - H[y, z] / slack
            H[z, y] = H[y, z]
    return LogBarrier(-g, H)


def _invariants(velocity_change: np.ndarray, moment: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """|Δv|², |q|² and Δv × q: the set is round, so nothing else matters."""
    (v0, v1), (q0, q1) = velocity_change, moment
    return v0 * v0 + v1 * v1, q0 * q0 + q1 * q1, v0 * q1 - v1 * q0
