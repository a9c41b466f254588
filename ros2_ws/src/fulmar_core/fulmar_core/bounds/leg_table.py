"""Times of legs between poses on a grid, to look up."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np

from fulmar_core.bounds.legs import best_words
from fulmar_core.bounds.motions import Motions

HEADINGS = 24  # in a full turn
_CELLS = 56  # to either side
_CELL = 0.1  # size in the smallest table [m]


@dataclass(frozen=True)
class LegTable:
    """Times over relative poses: so many cells to either side, ahead and to the left, and every heading."""

    times: np.ndarray  # (ahead, left, turn) in one row [s]
    cell: float  # [m]

    def step(self, cost: np.ndarray, before: np.ndarray, after: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """One leg further in dynamic programming over states (place, heading).

        Args:
            cost: Least time to each state before, shape (E, places, HEADINGS) [s].
            before: Places, shape (E, places, 2) [m].
            after: Places of the next disc, shape (E, places after, 2) [m].

        Returns:
            Least times to each state after and the states they come from, shapes (E, states).
        """
        angles = np.arange(HEADINGS) * (2.0 * math.pi / HEADINGS)
        c, s = np.cos(angles)[:, None], np.sin(angles)[:, None]
        move = ((after[:, None] - before[:, :, None]) / self.cell)[:, :, None]  # (E, before, 1, after, 2)
        ahead, left = c * move[..., 0] + s * move[..., 1], c * move[..., 1] - s * move[..., 0]
        column, row = (np.clip(np.rint(v), -_CELLS, _CELLS).astype(np.int32) + _CELLS for v in (ahead, left))
        first = (column * (2 * _CELLS + 1) + row) * HEADINGS
        turn = (np.arange(HEADINGS) - np.arange(HEADINGS)[:, None]) % HEADINGS
        total = self.times[first[..., None] + turn[:, None].astype(np.int32)]
        total += cost[..., None, None]
        total = total.reshape(len(cost), cost.shape[1] * HEADINGS, -1)
        origin = total.argmin(axis=1)
        return np.take_along_axis(total, origin[:, None], axis=1)[:, 0], origin


def table_scale(longest: np.ndarray) -> np.ndarray:
    """Number of the table that legs of some lengths fit in: each is twice as wide as the one before [m]."""
    return np.maximum(np.ceil(np.log2(longest / (_CELL * _CELLS))), 0.0).astype(int)


@functools.lru_cache(maxsize=8)
def leg_table(motions: Motions, scale: int) -> LegTable:
    """Table of a number from `table_scale`; kept in memory once made."""
    cell = _CELL * 2.0**scale
    axis = cell * np.arange(-_CELLS, _CELLS + 1)
    turns = np.arange(HEADINGS) * (2.0 * math.pi / HEADINGS)
    x, y, turn = np.meshgrid(axis, axis[_CELLS:], turns, indexing="ij")
    found, _ = best_words(motions, x.ravel(), y.ravel(), turn.ravel())
    left = found[0].reshape(x.shape)
    right = left[:, :0:-1, -np.arange(HEADINGS) % HEADINGS]  # the mirror image
    return LegTable(np.concatenate((right, left), axis=1).astype(np.float32).ravel(), cell)
