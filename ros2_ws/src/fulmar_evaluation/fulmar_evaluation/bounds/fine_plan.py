"""Plans made better on ever finer grids around them."""

from __future__ import annotations

import itertools

import numpy as np

from fulmar_evaluation.bounds.legs import all_words, best_words, leg_time
from fulmar_evaluation.bounds.motions import Motions
from fulmar_evaluation.bounds.turn_tour import TurnPlan, TurnTour, relative

_ROUNDS = 14
_STEPS = np.deg2rad([14.0, 7.0])  # of places on the disc and of headings, in the first round
_SHRINK = 0.8  # of the steps from round to round
_OFFSETS = np.array(list(itertools.product((-1.0, 0.0, 1.0), repeat=2)))  # of place and heading [steps]
_WORDS = 3  # ways of each leg that are looked at
_ANEW = (0, 1, 3, 6, 9)  # rounds in which they are chosen anew
_CHUNK = 16  # episodes at once: what a core's cache likes


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
