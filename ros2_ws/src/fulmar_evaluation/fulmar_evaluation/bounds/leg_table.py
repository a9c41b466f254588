"""Times of legs between poses on a grid, to look up."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass, replace

import numpy as np

from fulmar_evaluation.bounds.legs import MODES, best_words
from fulmar_evaluation.bounds.motions import Motions

HEADINGS = 24  # in a full turn
_CELLS = 56  # to either side
_CELL = 0.1  # size in the smallest table [m]


@dataclass(frozen=True)
class LegTable:
    """Times over relative poses: so many cells to either side, ahead and to the left, and every heading."""

    times: np.ndarray  # (modes before, modes after, ahead * left * turn) [s]
    cell: float  # [m]

    @property
    def modes(self) -> int:
        """How many of `MODES` differ; 1 where stops cost nothing."""
        return len(self.times)

    def step(self, cost: np.ndarray, before: np.ndarray, after: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """One leg further in dynamic programming over states (mode, place, heading).

        Args:
            cost: Least time to each state before, shape (E, modes, places, HEADINGS) [s].
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
        cells = first[..., None] + turn[:, None].astype(np.int32)  # (E, place, heading, place, heading)
        states = cost.shape[2] * HEADINGS
        least, origin = [], []
        for to in range(self.modes):
            time = np.full((len(cost), after.shape[1] * HEADINGS), np.inf, dtype=np.float32)
            source = np.zeros(time.shape, dtype=int)
            for mode in range(self.modes):
                total = self.times[mode, to][cells]
                total += cost[:, mode, :, :, None, None]
                total = total.reshape(len(cost), states, -1)
                found = total.argmin(axis=1)
                new = np.take_along_axis(total, found[:, None], axis=1)[:, 0]
                found += mode * states
                source = np.where(new < time, found, source)
                time = np.minimum(new, time)
            least.append(time)
            origin.append(source)
        return np.concatenate(least, axis=1), np.concatenate(origin, axis=1)


def table_scale(longest: np.ndarray) -> np.ndarray:
    """Number of the table that legs of some lengths fit in: each is twice as wide as the one before [m]."""
    return np.maximum(np.ceil(np.log2(longest / (_CELL * _CELLS))), 0.0).astype(int)


@functools.lru_cache(maxsize=8)
def leg_table(motions: Motions, scale: int) -> LegTable:
    """Table of a number from `table_scale`; kept in memory once made. It knows every other turn only."""
    cell = _CELL * 2.0**scale
    few = replace(motions, turns=motions.turns[::-2] if len(motions.turns) > 4 else motions.turns)
    axis = cell * np.arange(-_CELLS, _CELLS + 1)
    turns = np.arange(HEADINGS) * (2.0 * math.pi / HEADINGS)
    poses = [v.ravel() for v in np.meshgrid(axis, axis[_CELLS:], turns, indexing="ij")]
    modes = MODES if motions.surge else MODES[:1]
    times = [[_side(few, poses, (b, a) if motions.surge else None) for a in modes] for b in modes]
    return LegTable(np.array(times, dtype=np.float32), cell)


def _side(motions: Motions, poses: list[np.ndarray], modes: tuple[float, float] | None) -> np.ndarray:
    """Times to poses on the left, and their mirror images on the right, in one row."""
    ends = None if modes is None else (np.full(len(poses[0]), modes[0]), np.full(len(poses[0]), modes[1]))
    found, _ = best_words(motions, poses[0], poses[1], poses[2], ends)
    left = found[0].reshape(2 * _CELLS + 1, _CELLS + 1, HEADINGS)
    right = left[:, :0:-1, -np.arange(HEADINGS) % HEADINGS]
    return np.concatenate((right, left), axis=1).ravel()
