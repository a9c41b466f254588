"""Least squares that forget: how much of each of the newest commands a body's motion shows, part by part.

There are two parts, translation and rotation. Of many bodies the sums are arrays; of one they are plain numbers, which
cost a tenth.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

COMMANDS = 3  # that the fit looks back on, the newest first
KEEPS = 0.98  # of what was learned, from one step to the next
PRIOR = 1.0  # standard deviation of the three shares before anything was measured [-]
LEAST_GAIN = 0.3  # that delays are counted with [-]
LATE = np.arange(COMMANDS)
Rows = Sequence[Sequence[float]]


@dataclass(frozen=True)
class Fitted:
    """What a fit says, each shape (2, n)."""

    gain: np.ndarray  # thrust over the nominal one [-]
    unsure: np.ndarray  # its standard deviation [-]
    late: np.ndarray  # how many steps commands act late [-]
    vary: np.ndarray  # its standard deviation [-]


class ManyFit:
    """The fit of n bodies."""

    def __init__(self, count: int) -> None:
        """Know nothing."""
        self._information = np.tile(np.eye(COMMANDS) / PRIOR**2, (2, count, 1, 1))
        self._sums = np.zeros((2, count, COMMANDS))
        self._sums[..., 0] = 1.0 / PRIOR**2

    def add(self, columns: np.ndarray, change: np.ndarray) -> Fitted:
        """Take a step.

        Args:
            columns: What each command would have made of it, in standard deviations, shape (2, commands, n, 3).
            change: What was measured, likewise, shape (2, n, 3).
        """
        table = np.ascontiguousarray(np.moveaxis(columns, 1, 3))  # (2, n, 3, commands)
        across = np.swapaxes(table, 2, 3)
        self._information = KEEPS * self._information + across @ table
        self._sums = KEEPS * self._sums + (across @ change[..., None])[..., 0]
        spread = np.linalg.inv(self._information)
        share = (spread @ self._sums[..., None])[..., 0]  # (2, n, commands)
        gain = share.sum(axis=-1)
        unsure = np.sqrt(spread.sum(axis=(-1, -2)))
        safe = np.maximum(gain, LEAST_GAIN)
        late = (share @ LATE) / safe
        slope = (LATE - late[..., None]) / safe[..., None]
        vary = np.sqrt(np.einsum("pni,pnij,pnj->pn", slope, spread, slope))
        return Fitted(gain, unsure, late, vary)


class OneFit:
    """The fit of one part of one body, in plain numbers."""

    def __init__(self) -> None:
        """Know nothing."""
        prior = 1.0 / PRIOR**2
        self._information = prior, 0.0, 0.0, prior, 0.0, prior  # upper triangle, row by row
        self._sums = prior, 0.0, 0.0

    def add(self, columns: Rows, change: Sequence[float]) -> tuple[float, float, float, float]:
        """Take a step; the numbers of `Fitted`.

        Args:
            columns: What each command would have made of it, in standard deviations, three of three axes.
            change: What was measured, likewise, three axes.
        """
        a, b, c, d, e, f = (KEEPS * part for part in self._information)
        u, v, w = (KEEPS * part for part in self._sums)
        for first, second, third, seen in zip(*columns, change, strict=True):
            a, b, c = a + first * first, b + first * second, c + first * third
            d, e, f = d + second * second, e + second * third, f + third * third
            u, v, w = u + first * seen, v + second * seen, w + third * seen
        self._information, self._sums = (a, b, c, d, e, f), (u, v, w)
        return _fitted(a, b, c, d, e, f, u, v, w)


def _fitted(
    a: float, b: float, c: float, d: float, e: float, f: float, u: float, v: float, w: float
) -> tuple[float, float, float, float]:
    """The numbers of `Fitted` from a symmetric matrix, by its adjugate, and sums."""
    p, q, r = d * f - e * e, c * e - b * f, b * e - c * d
    s, t, z = a * f - c * c, b * c - a * e, a * d - b * b
    scale = 1.0 / (a * p + b * q + c * r)
    x, y, o = (p * u + q * v + r * w), (q * u + s * v + t * w), (r * u + t * v + z * w)
    gain = scale * (x + y + o)
    unsure = math.sqrt(scale * (p + s + z + 2.0 * (q + r + t)))
    safe = max(gain, LEAST_GAIN)
    late = scale * (y + 2.0 * o) / safe
    i, j, k = -late, 1.0 - late, 2.0 - late
    square = p * i * i + s * j * j + z * k * k + 2.0 * (q * i * j + r * i * k + t * j * k)
    return gain, unsure, late, math.sqrt(max(scale * square, 0.0)) / safe


class SingleFit:
    """The fit of one body, as `ManyFit`."""

    def __init__(self) -> None:
        """Know nothing."""
        self._parts = OneFit(), OneFit()

    def add(self, columns: np.ndarray, change: np.ndarray) -> Fitted:
        """See `ManyFit.add`."""
        made, seen = columns[:, :, 0].tolist(), change[:, 0].tolist()
        found = [part.add(made[number], seen[number]) for number, part in enumerate(self._parts)]
        return Fitted(*np.array(found).T[..., None])
