"""Newton steps of problems that are chains: each link knows only its two neighbours.

Many equal problems at once; the last axis counts them.
"""

from __future__ import annotations

import numpy as np

_LEAST_PIVOT = 1e-9  # of the diagonal: below it the curvature is taken as positive


def solve_chain(diagonal: np.ndarray, beside: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Solve block-tridiagonal symmetric systems by Cholesky's method, each made positive definite on the way.

    A pivot that is not positive is replaced by its magnitude (Nocedal and Wright, "Numerical Optimization",
    §3.4), so the answer to a gradient always points uphill.

    Args:
        diagonal: Blocks on the diagonal, shape (links, n, n, problems).
        beside: Block between each link and the next, shape (links - 1, n, n, problems).
        right: Right-hand sides, shape (links, n, problems).

    Returns:
        Solutions, shape (links, n, problems).
    """
    links, n = right.shape[0], right.shape[1]
    factors: list[np.ndarray] = []
    couplings: list[np.ndarray] = []
    parts: list[np.ndarray] = []
    for link in range(links):
        block, part = diagonal[link].copy(), right[link].copy()
        if link:
            above = couplings[-1]
            for k in range(n):
                block -= above[k][:, None] * above[k][None, :]
                part -= above[k] * parts[-1][k]
        factor = _cholesky(block, diagonal[link])
        factors.append(factor)
        parts.append(_forward(factor, part))
        if link < links - 1:
            couplings.append(_forward(factor, beside[link]))
    solution = np.empty_like(right)
    for link in range(links - 1, -1, -1):
        part = parts[link]
        if link < links - 1:
            part = part - np.sum(couplings[link] * solution[link + 1][None], axis=1)
        solution[link] = _backward(factors[link], part)
    return solution


def _cholesky(block: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """Lower factor of each block; `scale` has the diagonal that pivots are compared with."""
    n = block.shape[0]
    lower = np.zeros_like(block)
    for j in range(n):
        pivot = block[j, j].copy()
        for k in range(j):
            pivot -= lower[j, k] * lower[j, k]
        lower[j, j] = np.sqrt(np.maximum(np.abs(pivot), _LEAST_PIVOT * np.abs(scale[j, j])))
        for i in range(j + 1, n):
            entry = block[i, j].copy()
            for k in range(j):
                entry -= lower[i, k] * lower[j, k]
            lower[i, j] = entry / lower[j, j]
    return lower


def _forward(lower: np.ndarray, right: np.ndarray) -> np.ndarray:
    answer = np.empty_like(right)
    for i in range(len(right)):
        row = right[i].copy()
        for k in range(i):
            row -= lower[i, k] * answer[k]
        answer[i] = row / lower[i, i]
    return answer


def _backward(lower: np.ndarray, right: np.ndarray) -> np.ndarray:
    answer = np.empty_like(right)
    for i in range(len(right) - 1, -1, -1):
        row = right[i].copy()
        for k in range(i + 1, len(right)):
            row -= lower[k, i] * answer[k]
        answer[i] = row / lower[i, i]
    return answer
