"""Fastest plans over where and how each disc is touched, on a coarse grid, by dynamic programming."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fulmar_evaluation.bounds.leg_table import HEADINGS, LegTable
from fulmar_evaluation.bounds.legs import MODES
from fulmar_evaluation.bounds.turn_tour import TurnPlan, TurnTour

_PLACES = np.deg2rad(np.linspace(-105.0, 105.0, 8))  # on a disc, from the side that the way comes from
_CHUNK = 16  # episodes at once: what a core's cache likes


@dataclass(frozen=True, slots=True)
class CoarsePlans:
    """Plans to every number of goals."""

    times: np.ndarray  # (E, goals) least time of each goal [s]
    last: np.ndarray  # (goals, E) state in which it is reached then
    source: np.ndarray  # (goals, E, states) state at the goal before
    approach: np.ndarray  # (E, goals) [rad]

    @property
    def goals(self) -> int:
        """Goals that there are plans for."""
        return int(self.times.shape[1])

    def plan_to(self, episodes: np.ndarray, number: np.ndarray) -> TurnPlan:
        """Plans to so many goals each; what they do beyond means nothing."""
        goals = int(number.max())
        states = np.zeros((len(episodes), goals + 1), dtype=int)
        here = np.zeros(len(episodes), dtype=int)
        for goal in range(goals, 0, -1):
            here = np.where(goal == number, self.last[goal - 1, episodes], here)
            states[:, goal] = here
            here = np.where(goal <= number, self.source[goal - 1, episodes, here], here)
        states[:, 0] = here
        rest, heading = np.divmod(states, HEADINGS)
        mode, place = np.divmod(rest[:, 1:], len(_PLACES))
        mode = np.concatenate((rest[:, :1], mode), axis=1)  # there is but one place to start from
        angle = self.approach[episodes, :goals] + _PLACES[place]
        return TurnPlan(angle, heading * (2.0 * math.pi / HEADINGS), MODES[mode])


def coarse_plans(tour: TurnTour, table: LegTable, latest: float) -> CoarsePlans:
    """Plan ahead until no episode has time left.

    Args:
        tour: The discs.
        table: Times of legs.
        latest: Time after which nothing matters [s].
    """
    approach = tour.approach
    touches = tour.touch(approach[:, :, None] + _PLACES)
    count, states = len(tour.start), table.modes * len(_PLACES) * HEADINGS
    cost = np.full((count, table.modes, 1, HEADINGS), np.inf, dtype=np.float32)
    cost[:, -1] = 0.0  # at rest
    if tour.yaw is not None:
        at = np.rint(tour.yaw * (HEADINGS / (2.0 * math.pi))).astype(int) % HEADINGS
        cost[:, -1, 0] = np.where(np.arange(HEADINGS) == at[:, None], 0.0, np.inf)
    before = tour.start[:, None]
    times, last, source = [], [], []
    for goal in range(tour.centres.shape[1]):
        new, origin = np.empty((count, states), dtype=np.float32), np.empty((count, states), dtype=np.int16)
        for begin in range(0, count, _CHUNK):
            some = slice(begin, begin + _CHUNK)
            new[some], origin[some] = table.step(cost[some], before[some], touches[some, goal])
        times.append(new.min(axis=1))
        last.append(new.argmin(axis=1))
        source.append(origin)
        if np.all(times[-1] > latest):
            break
        cost, before = new.reshape(count, table.modes, len(_PLACES), HEADINGS), touches[:, goal]
    return CoarsePlans(np.stack(times, axis=1).astype(float), np.stack(last), np.stack(source), approach)
