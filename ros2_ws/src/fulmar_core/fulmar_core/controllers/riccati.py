"""The linear feedback that costs least, over all time to come."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Regulator:
    """u = -gain x, for x' = a x + b u and the cost x' q x + u' r u of each step."""

    gain: np.ndarray  # (m, n)
    cost_to_go: np.ndarray  # (n, n): x' p x is what is still to be paid
    hessian: np.ndarray  # (m, m): what an input u costs, now and later, is u' (r + b' p b) u


def regulator(a: np.ndarray, b: np.ndarray, q: np.ndarray, r: np.ndarray) -> Regulator:
    """Solve the discrete algebraic Riccati equation.

    Args:
        a: Shape (n, n).
        b: Shape (n, m).
        q: Cost of states, shape (n, n).
        r: Cost of inputs, shape (m, m).

    Raises:
        numpy.linalg.LinAlgError: No feedback makes it stable.
    """
    # It takes a fifth of a second to import, which every process would pay for, and few solve anything.
    from scipy.linalg import solve_discrete_are

    p = solve_discrete_are(a, b, q, r)
    hessian = r + b.T @ p @ b
    return Regulator(np.linalg.solve(hessian, b.T @ p @ a), p, hessian)
