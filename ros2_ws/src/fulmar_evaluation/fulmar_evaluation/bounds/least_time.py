"""Least time of a point mass through discs in order, by an interior-point method, for many episodes at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fulmar_evaluation.bounds.chain import solve_chain
from fulmar_evaluation.bounds.disc_tour import (
    P0,
    P1,
    V0,
    V1,
    DiscTour,
    H,
    Limit,
    Links,
    Plan,
    all_slacks,
    limits,
    links_of,
    stop_and_go,
)
from fulmar_evaluation.bounds.reachable_set import log_barrier

_WEIGHTS = np.array([0.3, 0.03, 0.003, 0.0003, 0.0001])  # of the barrier, one after the other [time]
_CENTRED = 0.3  # a weight is done with when Newton's step promises less than this share of it
_MOST_STEPS = 100  # few episodes need more than 60: discs that overlap, where durations go to 0
_MOST_HALVINGS = 40


def least_times(tour: DiscTour, plan: Plan | None = None) -> np.ndarray:
    """Times at which a time-optimal plan touches each disc.

    The whole time is minimised over the states at the discs and the durations between them, with the barrier
    method (Boyd and Vandenberghe, "Convex Optimization", §11.3) from a stop-and-go plan. What the last weight of
    the barrier can cost is taken off, so times are rather too short than too long.

    Args:
        tour: The discs.
        plan: Where to begin instead, inside all limits; it is overwritten.

    Returns:
        Times in the units of the tour, shape (goals, E); those of discs that do not count are NaN.
    """
    plan, weight = _descend(tour, plan or stop_and_go(tour))
    active = tour.active
    times = np.cumsum(np.where(active, plan.durations, 0.0), axis=0)
    total = times[-1]
    shorter = np.maximum(total - weight * tour.constraints, 0.0) / np.maximum(total, 1e-12)
    return np.asarray(np.where(active, times * shorter, np.nan))


def _descend(tour: DiscTour, plan: Plan) -> tuple[Plan, np.ndarray]:
    """Lower each episode's barrier; `plan` is overwritten. Gives it and the last weight that was done with, (E,)."""
    level = np.zeros(plan.durations.shape[1], dtype=int)
    damping = np.zeros(len(level))
    for _ in range(_MOST_STEPS):
        running = np.flatnonzero(level < len(_WEIGHTS))
        if running.size == 0:
            break
        part, weight, here = tour.of(running), _WEIGHTS[level[running]], plan.of(running)
        step = _newton_step(part, here, weight, damping[running])
        found = _search(part, here, step, weight)
        plan.write(running, here)
        # Damped where Newton's method alone does not go downhill (Levenberg and Marquardt).
        moved, old = found & step.definite, damping[running]
        damping[running] = np.where(moved, 0.2 * old * (old > 1e-4), np.maximum(10.0 * old, 1e-3))
        level[running] += step.definite & ((-step.slope < _CENTRED * weight) | (damping[running] > 1e6))
    return plan, _WEIGHTS[np.maximum(level - 1, 0)]


@dataclass(frozen=True, slots=True)
class _Step:
    states: np.ndarray  # (links, 4, E)
    durations: np.ndarray  # (links, E)
    slope: np.ndarray  # (E,) of the cost along the step, < 0
    definite: np.ndarray  # (E,) whether it is a step at all


def _search(tour: DiscTour, plan: Plan, step: _Step, weight: np.ndarray) -> np.ndarray:
    """Halve the step until the cost falls (Armijo's rule); moves `plan`, returns where that was possible."""
    before = _cost(tour, plan, weight)
    size = np.ones(len(weight))
    todo = np.flatnonzero(step.definite)
    for _ in range(_MOST_HALVINGS):
        trial = Plan(
            plan.states[:, :, todo] + size[todo] * step.states[:, :, todo],
            plan.durations[:, todo] + size[todo] * step.durations[:, todo],
        )
        after = _cost(tour.of(todo), trial, weight[todo])
        good = after <= before[todo] + 1e-4 * size[todo] * step.slope[todo]
        plan.write(todo[good], trial.of(good))
        todo = todo[~good]
        if todo.size == 0:
            break
        size[todo] *= 0.5
    found = step.definite.copy()
    found[todo] = False
    return found


def _cost(tour: DiscTour, plan: Plan, weight: np.ndarray) -> np.ndarray:
    """Time and barrier, shape (E,); infinite outside the limits."""
    barrier, others = all_slacks(tour, plan)
    active = tour.active
    kept = np.logical_and.reduce([slack > 0.0 for slack in (*barrier, *others)]) | ~active
    with np.errstate(invalid="ignore", divide="ignore"):
        logs = np.sum([np.log(slack) for slack in barrier], axis=0)
    terms = np.where(active, plan.durations - weight * logs, 0.0)
    return np.where(np.all(kept, axis=0), np.sum(terms, axis=0), np.inf)


def _newton_step(tour: DiscTour, plan: Plan, weight: np.ndarray, damping: np.ndarray) -> _Step:
    """Newton's step with the durations eliminated link by link, and the states by `solve_chain`."""
    links, active = links_of(tour, plan), tour.active
    with np.errstate(all="ignore"):
        gradient, hessian = _reach_model(plan, links)
        for limit in limits(tour, plan, links):
            _add(gradient, hessian, limit)
    gradient = np.where(active, weight * gradient, 0.0)
    hessian = np.where(active, weight * hessian, 0.0)
    gradient[H] += active
    # What is left of the first and last state of each link once its duration is the best one.
    by_duration = 1.0 / np.where(active, np.maximum(np.abs(hessian[H, H]), 1e-12), 1.0)
    across, slope = hessian[H, :H], gradient[H]
    left = gradient[:H] - across * (slope * by_duration)
    block = hessian[:H, :H] - across[:, None] * (across[None] * by_duration)
    right, diagonal = left[4:8], block[4:8, 4:8]
    right[:, :-1] += left[0:4, 1:]
    diagonal[:, :, :-1] += block[0:4, 0:4, 1:]
    for i in range(4):
        diagonal[i, i] += damping * np.abs(diagonal[i, i]) + ~active
    states, definite = solve_chain(
        diagonal.transpose(2, 0, 1, 3), block[0:4, 4:8, 1:].transpose(2, 0, 1, 3), -right.transpose(1, 0, 2)
    )
    change = states.swapaxes(0, 1)
    before = np.concatenate((np.zeros_like(change[:, :1]), change[:, :-1]), axis=1)
    along = slope + np.sum(across[0:4] * before + across[4:8] * change, axis=0)
    promised = np.sum(right * change, axis=(0, 1)) - np.sum(slope * slope * by_duration, axis=0)
    return _Step(states, -along * by_duration * active, promised, definite)


def _reach_model(plan: Plan, links: Links) -> tuple[np.ndarray, np.ndarray]:
    """Gradient (9, links, E) and curvature (9, 9, links, E) of the barrier of `reach`, by a link's variables."""
    barrier = log_barrier(links.gain, links.moment, plan.durations)
    half, mean = 0.5 * plan.durations, links.mean
    g_v, g_q, g_h = barrier.gradient[0:2], barrier.gradient[2:4], barrier.gradient[4]
    A, B, Q = barrier.hessian[0:2, 0:2], barrier.hessian[0:2, 2:4], barrier.hessian[2:4, 2:4]
    h_v, h_q, h_h = barrier.hessian[0:2, 4], barrier.hessian[2:4, 4], barrier.hessian[4, 4]
    # Δv = v1 - v0 and q = p1 - p0 - h (v0 + v1) / 2.
    gradient = np.concatenate((-g_q, -g_v - half * g_q, g_q, g_v - half * g_q, g_h[None]))
    gradient[H] -= np.sum(g_q * mean, axis=0)
    hessian = np.empty((9, 9, *half.shape))
    Bt, half_Q = B.swapaxes(0, 1), half * Q
    hessian[P0, P0] = hessian[P1, P1] = Q
    hessian[P0, P1] = hessian[P1, P0] = -Q
    hessian[P1, V1], hessian[P0, V1] = Bt - half_Q, half_Q - Bt
    hessian[P1, V0], hessian[P0, V0] = -Bt - half_Q, Bt + half_Q
    hessian[V1, P1], hessian[V1, P0] = B - half_Q, half_Q - B
    hessian[V0, P1], hessian[V0, P0] = -B - half_Q, B + half_Q
    hessian[V1, V1] = A - half * (B + Bt) + half * half_Q
    hessian[V0, V0] = A + half * (B + Bt) + half * half_Q
    hessian[V0, V1] = half * (B - Bt) - A + half * half_Q
    hessian[V1, V0] = half * (Bt - B) - A + half * half_Q
    h_v = h_v - B[:, 0] * mean[0] - B[:, 1] * mean[1]
    h_h = h_h - np.sum(h_q * mean, axis=0)
    h_q = h_q - Q[:, 0] * mean[0] - Q[:, 1] * mean[1]
    turn = half * h_q + 0.5 * g_q
    hessian[H, :H] = np.concatenate((-h_q, -h_v - turn, h_q, h_v - turn))
    hessian[:H, H] = hessian[H, :H]
    hessian[H, H] = h_h - np.sum(h_q * mean, axis=0)
    return gradient, hessian


def _add(gradient: np.ndarray, hessian: np.ndarray, limit: Limit) -> None:
    """Add the derivatives of -log(slack) of one limit."""
    inverse = 1.0 / limit.slack
    scaled = {i: first * inverse for i, first in limit.first.items()}
    for i, slope in scaled.items():
        gradient[i] -= slope
        for j, other in scaled.items():
            hessian[i, j] += slope * other
    for (i, j), second in limit.second.items():
        hessian[i, j] -= second * inverse
        if i != j:
            hessian[j, i] -= second * inverse
