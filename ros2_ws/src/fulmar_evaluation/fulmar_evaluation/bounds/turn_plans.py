"""Discs to touch in order, and the fastest plans through them: on a coarse grid, then on ever finer ones."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np

from fulmar_evaluation.bounds.leg_table import HEADINGS, LegTable
from fulmar_evaluation.bounds.legs import MODES, all_words, best_words, leg_time
from fulmar_evaluation.bounds.motions import Motions


@dataclass(frozen=True, slots=True)
class TurnTour:
    """Discs of some episodes."""

    start: np.ndarray  # (E, 2) [m]
    yaw: np.ndarray | None  # (E,) heading at the start; None: any [rad]
    centres: np.ndarray  # (E, goals, 2) [m]
    radius: float  # [m]

    @property
    def approach(self) -> np.ndarray:
        """Direction from each disc to the one before, shape (E, goals) [rad]."""
        before = np.concatenate((self.start[:, None], self.centres[:, :-1]), axis=1)
        back = before - self.centres
        return np.asarray(np.arctan2(back[..., 1], back[..., 0]))

    def touch(self, angle: np.ndarray) -> np.ndarray:
        """Points of the discs' edges.

        Args:
            angle: From the x axis, shape (E, goals, n) [rad].

        Returns:
            Shape (E, goals, n, 2) [m].
        """
        edge = np.stack((np.cos(angle), np.sin(angle)), axis=-1)
        return np.asarray(self.centres[:, :, None] + self.radius * edge)

    def of(self, episodes: np.ndarray | slice, goals: int) -> TurnTour:
        """Some of the episodes, and the first goals."""
        yaw = None if self.yaw is None else self.yaw[episodes]
        return TurnTour(self.start[episodes], yaw, self.centres[episodes, :goals], self.radius)


@dataclass(frozen=True, slots=True)
class TurnPlan:
    """Where discs are touched, and headings there."""

    angle: np.ndarray  # (E, goals) of the touch on the disc's edge [rad]
    heading: np.ndarray  # (E, goals + 1) at the start and at each touch [rad]
    mode: np.ndarray  # (E, goals + 1) whether they are passed ahead (1), astern (-1) or at rest (0)

    def of(self, episodes: np.ndarray | slice) -> TurnPlan:
        """Some of the episodes."""
        return TurnPlan(self.angle[episodes], self.heading[episodes], self.mode[episodes])


def relative(before: np.ndarray, heading: np.ndarray, after: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """How far ahead and to the left a place lies; places have a last axis of x and y."""
    move = after - before
    c, s = np.cos(heading), np.sin(heading)
    return c * move[..., 0] + s * move[..., 1], c * move[..., 1] - s * move[..., 0]


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


_ROUNDS = 14
_STEPS = np.deg2rad([14.0, 7.0])  # of places on the disc and of headings, in the first round
_SHRINK = 0.8  # of the steps from round to round
_OFFSETS = np.array(list(itertools.product((-1.0, 0.0, 1.0), repeat=2)))  # of place and heading [steps]
_WORDS = 3  # ways of each leg that are looked at
_ANEW = (0, 1, 3, 6, 9)  # rounds in which they are chosen anew


def refined(
    tour: TurnTour, motions: Motions, plan: TurnPlan, counts: np.ndarray
) -> tuple[TurnPlan, np.ndarray]:
    """Shorten plans.

    Args:
        tour: The discs.
        motions: What the robot can hold.
        plan: Where to begin.
        counts: Goals of each plan; what it does beyond does not count, shape (E,).

    Returns:
        The better plans, and their times from 0 at the start on, shape (E, goals + 1) [s].
    """
    angle, heading = plan.angle.copy(), plan.heading.copy()
    if tour.yaw is not None:
        heading[:, 0] = tour.yaw
    plan = TurnPlan(angle, heading, plan.mode)
    for number, size in enumerate(_SHRINK ** np.arange(_ROUNDS)):
        if number in _ANEW:
            words = all_words(motions)[_ways(tour, motions, plan, _WORDS)[1]]
        for begin in range(0, len(angle), _CHUNK):
            some = slice(begin, begin + _CHUNK)
            part = tour.of(some, angle.shape[1])
            better = _round(part, words[:, some], motions, plan.of(some), counts[some], size * _STEPS)
            angle[some], heading[some] = better.angle, better.heading
    times, _ = _ways(tour, motions, plan, 1)
    return plan, np.concatenate((np.zeros((len(angle), 1)), np.cumsum(times[0], axis=1)), axis=1)


def _ways(tour: TurnTour, motions: Motions, plan: TurnPlan, count: int) -> tuple[np.ndarray, np.ndarray]:
    """The fastest ways of each leg of a plan: times and words, shapes (count, E, goals)."""
    places = np.concatenate((tour.start[:, None], tour.touch(plan.angle[..., None])[:, :, 0]), axis=1)
    x, y = relative(places[:, :-1], plan.heading[:, :-1], places[:, 1:])
    turn = np.diff(plan.heading, axis=1)
    before, after = _ends(plan)
    modes = (before.ravel(), after.ravel()) if motions.surge else None
    times, rows = best_words(motions, x.ravel(), y.ravel(), turn.ravel(), modes, count=count)
    return times.reshape(count, *x.shape), rows.reshape(count, *x.shape)


def _ends(plan: TurnPlan) -> tuple[np.ndarray, np.ndarray]:
    """How both ends of each leg are passed, shapes (E, goals)."""
    return plan.mode[:, :-1], plan.mode[:, 1:]


def _round(
    tour: TurnTour,
    words: np.ndarray,
    motions: Motions,
    plan: TurnPlan,
    counts: np.ndarray,
    steps: np.ndarray,
) -> TurnPlan:
    """Dynamic programming over the neighbours of each state, with words of shape (ways, E, goals, 5)."""
    angles = plan.angle[..., None] + steps[0] * _OFFSETS[:, 0]
    headings = plan.heading[..., None] + steps[1] * _OFFSETS[:, 1]
    if tour.yaw is not None:
        headings[:, 0] = plan.heading[:, :1]
    n = len(_OFFSETS)
    start = np.broadcast_to(tour.start[:, None, None], (len(angles), 1, n, 2))
    places = np.concatenate((start, tour.touch(angles)), axis=1)
    x, y = relative(places[:, :-1, :, None], headings[:, :-1, :, None], places[:, 1:, None])
    turn = headings[:, 1:, None] - headings[:, :-1, :, None]
    times = np.full(x.shape, np.inf)
    before, after = (mode[..., None, None] for mode in _ends(plan))
    modes = (before, after) if motions.surge else None
    for way in words:
        word = tuple(way[..., None, None, i] for i in range(5))
        times = np.minimum(times, leg_time(motions, word, x, y, turn, modes))
    goals = angles.shape[1]
    times[np.arange(goals) >= counts[:, None]] = 0.0
    cost, source = np.zeros((len(angles), n)), []
    for goal in range(goals):
        total = cost[:, :, None] + times[:, goal]
        source.append(total.argmin(axis=1))
        cost = total.min(axis=1)
    pick = np.empty((len(angles), goals + 1), dtype=int)
    pick[:, goals] = cost.argmin(axis=1)
    for goal in range(goals, 0, -1):
        pick[:, goal - 1] = np.take_along_axis(source[goal - 1], pick[:, goal, None], axis=1)[:, 0]
    return TurnPlan(
        np.take_along_axis(angles, pick[:, 1:, None], axis=2)[..., 0],
        np.take_along_axis(headings, pick[..., None], axis=2)[..., 0],
        plan.mode,
    )
