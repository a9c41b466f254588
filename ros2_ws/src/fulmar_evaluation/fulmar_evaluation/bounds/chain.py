"""Newton steps of problems that are chains: each link knows only its two neighbours.

Many equal problems at once; the last axis counts them.
"""

from __future__ import annotations

import numpy as np

_LEAST_PIVOT = 1e-10  # of the diagonal: less is rounding


def solve_chain(diagonal: np.ndarray, beside: np.ndarray, right: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Solve block-tridiagonal symmetric systems by Cholesky's method.

    Args:
        diagonal: Blocks on the diagonal, shape (links, n, n, problems).
        beside: Block between each link and the next, shape (links - 1, n, n, problems).
        right: Right-hand sides, shape (links, n, problems).

    Returns:
        Solutions, shape (links, n, problems), and which systems are positive definite, shape (problems,); the
        solutions of others mean nothing.
    """
    factors: list[np.ndarray] = []
    couplings: list[np.ndarray] = []
    parts: list[np.ndarray] = []
    definite = np.ones(right.shape[2], dtype=bool)
    for link in range(len(right)):
        block, part = diagonal[link].copy(), right[link].copy()
        if link:
            for row, known in zip(couplings[-1], parts[-1], strict=True):
                block -= row[:, None] * row[None, :]
                part -= row * known
        factors.append(_cholesky(block, _LEAST_PIVOT * diagonal[link], definite))
        parts.append(_forward(factors[-1], part))
        if link < len(beside):
            couplings.append(_forward(factors[-1], beside[link]))
    solution = np.empty_like(right)
    for link in range(len(right) - 1, -1, -1):
        part = parts[link]
        if link < len(beside):
            part = part - np.sum(couplings[link] * solution[link + 1][None], axis=1)
        solution[link] = _backward(factors[link], part)
    return solution, definite


def _cholesky(block: np.ndarray, least: np.ndarray, definite: np.ndarray) -> np.ndarray:
    """Lower factor of each block; where a pivot is not above `least`, `definite` becomes false."""
    lower = np.zeros_like(block)
    for j in range(len(block)):
        pivot = block[j, j].copy()
        for k in range(j):
            pivot -= lower[j, k] * lower[j, k]
        good = pivot > np.maximum(least[j, j], 0.0)
        definite &= good
        lower[j, j] = np.sqrt(np.where(good, pivot, np.inf))
        for i in range(j + 1, len(block)):
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
