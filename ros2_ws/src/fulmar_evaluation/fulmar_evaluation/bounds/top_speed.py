"""Bound on visits at top speed: the shortest way that touches the discs, with no time lost for turning."""

from __future__ import annotations

import numpy as np

from fulmar_evaluation.bounds.chain import solve_chain
from fulmar_evaluation.bounds.visits import Bound, Route, route_of

_WEIGHTS = (1.0, 0.2, 0.04, 0.008, 0.0016, 0.0003)  # of the barrier, one after the other [m]
_STEPS = 6  # of Newton's method, at each weight
_MOST_HALVINGS = 30
_ROUNDING = 1e-3  # lengths are rounded off below this [m]
_BATCH = 512  # episodes at once: what a core's cache likes


def top_speed_bound(
    start_xy: np.ndarray,
    waypoints: np.ndarray,
    *,
    radius: float,
    top_speed: float,
    duration_s: float,
    loop: bool = True,
) -> Bound:
    """Most waypoints that anything slower than a top speed can visit in order.

    A true bound: the length of the way is that of a dual solution, which no way can be shorter than.

    Args:
        start_xy: Where episodes start, shape (..., 2) [m].
        waypoints: Shape (..., K, 2) [m].
        radius: How near a visit is [m].
        top_speed: Largest speed [m/s].
        duration_s: Length of an episode [s].
        loop: The first waypoint comes after the last again.

    Returns:
        The bound, shapes (...,).

    Raises:
        ValueError: Something is not positive, or the number has no bound.
    """
    if not 0.0 < top_speed < np.inf:
        raise ValueError("'top_speed' must be finite and greater than 0.")
    route = route_of(start_xy, waypoints, radius=radius, duration_s=duration_s, loop=loop)
    reach = top_speed * duration_s
    first, legs = route.legs()
    goals = route.goals_after(np.maximum(first - radius, 0.0), np.maximum(legs - 2.0 * radius, 0.0), reach)
    progress = np.zeros(route.episodes)
    order = np.argsort(goals, kind="stable")
    for begin in range(0, len(order), _BATCH):
        some = order[begin : begin + _BATCH]
        progress[some] = _progress(route, some, int(goals[some].max()), radius, reach)
    return Bound(np.floor(progress).astype(int).reshape(route.shape), progress.reshape(route.shape))


def _progress(route: Route, some: np.ndarray, goals: int, radius: float, reach: float) -> np.ndarray:
    lengths = shortest_lengths(route.start[some].T, route.centres(some, goals), radius=radius)
    done = np.sum(lengths <= reach, axis=0)
    padded = np.concatenate((np.zeros((1, len(some))), lengths, np.full((1, len(some)), np.inf)))
    before, after = (np.take_along_axis(padded, (done + i)[None], axis=0)[0] for i in (0, 1))
    return np.asarray(done + (reach - before) / np.maximum(after - before, 1e-12))


def shortest_lengths(start: np.ndarray, centres: np.ndarray, *, radius: float) -> np.ndarray:
    """Lengths that no way is shorter than which touches the first discs in order.

    With any vectors u_k of length 1 or less, Σ |p_k - p_(k-1)| >= Σ u_k · (p_k - p_(k-1)), and the least of the
    right side over points p_k in discs around c_k has a closed form: Σ w_k · c_k - r |w_k| - u_1 · p_0, with
    w_k = u_k - u_(k+1). The directions of the shortest way make the two sides equal; those of a nearly shortest
    way, as Newton's method leaves it here, make a bound that is valid all the same.

    Args:
        start: Shape (2, E) [m].
        centres: Shape (goals, 2, E) [m].
        radius: Of all discs [m].

    Returns:
        Length to each disc, shape (goals, E), never falling along a way [m].
    """
    points = _shortest_way(start, centres, radius)
    before = np.concatenate((start[None], points[:-1]))
    u = _unit(points - before)
    w = u[:-1] - u[1:]
    gains = np.sum(w * centres[:-1], axis=1) - radius * np.linalg.norm(w, axis=1)
    sums = np.cumsum(np.concatenate((-np.sum(u[0] * start, axis=0)[None], gains)), axis=0)
    ends = np.sum(u * centres, axis=1) - radius * np.linalg.norm(u, axis=1)
    lengths = sums + ends
    # A way that ends here may end with another direction than one that goes on.
    last = _unit(centres - before)
    lengths[0] = np.maximum(lengths[0], np.sum(last[0] * (centres[0] - start), axis=0) - radius)
    w = u[:-1] - last[1:]
    turned = np.sum(w * centres[:-1], axis=1) - radius * np.linalg.norm(w, axis=1)
    turned += sums[:-1] + np.sum(last[1:] * centres[1:], axis=1) - radius
    lengths[1:] = np.maximum(lengths[1:], turned)
    return np.maximum.accumulate(np.maximum(lengths, 0.0), axis=0)


def _unit(vectors: np.ndarray) -> np.ndarray:
    """Directions over axis 1; shorter than 1 below the rounding."""
    return np.asarray(vectors / np.sqrt(np.sum(vectors * vectors, axis=1, keepdims=True) + _ROUNDING**2))


def _shortest_way(start: np.ndarray, centres: np.ndarray, radius: float) -> np.ndarray:
    """Points of a nearly shortest way, shape (goals, 2, E): a convex problem, by the barrier method."""
    points = centres.copy()
    for weight in _WEIGHTS:
        for _ in range(_STEPS):
            step, slope = _newton_step(start, points, centres, radius, weight)
            before = _cost(start, points, centres, radius, weight)
            size = np.ones(len(slope))
            for _ in range(_MOST_HALVINGS):
                after = _cost(start, points + size * step, centres, radius, weight)
                poor = after > before + 1e-4 * size * slope
                if not poor.any():
                    break
                size[poor] *= 0.5
            points += np.where(poor, 0.0, size) * step
    return points


def _cost(
    start: np.ndarray, points: np.ndarray, centres: np.ndarray, radius: float, weight: float
) -> np.ndarray:
    leg = np.diff(points, axis=0, prepend=start[None])
    slack = radius**2 - np.sum((points - centres) ** 2, axis=1)
    length = np.sqrt(np.sum(leg * leg, axis=1) + _ROUNDING**2)
    with np.errstate(invalid="ignore", divide="ignore"):
        total = np.sum(length - weight * np.log(slack), axis=0)
    return np.where(np.all(slack > 0.0, axis=0), total, np.inf)


def _newton_step(
    start: np.ndarray, points: np.ndarray, centres: np.ndarray, radius: float, weight: float
) -> tuple[np.ndarray, np.ndarray]:
    leg = np.diff(points, axis=0, prepend=start[None])
    length = np.sqrt(np.sum(leg * leg, axis=1, keepdims=True) + _ROUNDING**2)
    u, offset = leg / length, points - centres
    inverse = 1.0 / (radius**2 - np.sum(offset * offset, axis=1, keepdims=True))
    eye = np.eye(2)[None, :, :, None]
    stiff = (eye - u[:, :, None] * u[:, None]) / length[:, None]
    diagonal = stiff + 2.0 * weight * eye * inverse[:, None]
    diagonal += 4.0 * weight * offset[:, :, None] * offset[:, None] * inverse[:, None] ** 2
    diagonal[:-1] += stiff[1:]
    gradient = u + 2.0 * weight * offset * inverse
    gradient[:-1] -= u[1:]
    step, _ = solve_chain(diagonal, -stiff[1:], -gradient)
    return step, np.sum(step * gradient, axis=(0, 1))
