"""Bound on visits of a mass whose acceleration is limited: count what a time-optimal plan reaches."""

from __future__ import annotations

import math

import numpy as np

from fulmar_evaluation.bounds.disc_tour import DiscTour
from fulmar_evaluation.bounds.least_time import least_times
from fulmar_evaluation.bounds.visits import Bound, Route, route_of

_BATCH = 512  # episodes at once: what a core's cache likes
_LEG_TIME = 1.28  # guess: times the root of a leg's length over the acceleration


def time_optimal_bound(
    start_xy: np.ndarray,
    start_velocity: np.ndarray,
    waypoints: np.ndarray,
    *,
    radius: float,
    acceleration: float,
    top_speed: float = math.inf,
    duration_s: float,
    loop: bool = True,
) -> Bound:
    """Most waypoints that a point mass can visit in order, its acceleration limited alike in all directions.

    The number is the largest n whose least time is at most `duration_s`; each n is optimised on its own, since
    whoever wants n waypoints need not care for the next. A least time is the optimum of a smooth problem in the
    states at the discs and the durations between them. Nothing is discretised, and what is simplified shortens it,
    by 0.1 to 1.1 % in all against a direct transcription with 24 pieces of constant acceleration a leg:

    - what can be reached in a given time is described by a set that is a little too large (`reach`);
    - a top speed holds at the discs, for each mean velocity, and along the line between two centres;
    - what the barrier method leaves above the optimum is taken off again (`least_times`).

    The problem is not convex. That its optimum is the global one is not proven, only found: starts from random
    velocities at all discs ended in the same optimum (`tests/fulmar_evaluation/test_bounds.py`).

    Args:
        start_xy: Where episodes start, shape (..., 2) [m].
        start_velocity: In the world, shape (..., 2) [m/s].
        waypoints: Shape (..., K, 2) [m].
        radius: How near a visit is [m].
        acceleration: Largest acceleration, the same in all directions [m/s²].
        top_speed: Largest speed [m/s].
        duration_s: Length of an episode [s].
        loop: The first waypoint comes after the last again.

    Returns:
        The bound, shapes (...,). Beyond the last whole waypoint, progress is the share of time to the next.

    Raises:
        ValueError: Something is not positive, a start is faster than the top speed, or the number has no bound.
    """
    if not (0.0 < acceleration < math.inf and top_speed > 0.0):
        raise ValueError("'acceleration' and 'top_speed' must be greater than 0, and 'acceleration' finite.")
    route = route_of(start_xy, waypoints, radius=radius, duration_s=duration_s, loop=loop)
    velocity = np.broadcast_to(start_velocity, (*route.shape, 2)).reshape(-1, 2)
    if np.any(np.linalg.norm(velocity, axis=1) >= top_speed):
        raise ValueError("'start_velocity' must be slower than 'top_speed'.")
    # With the root of the acceleration as unit of speed and of 1/time, the largest acceleration is 1.
    unit = math.sqrt(acceleration)
    start = np.concatenate((route.start, velocity / unit), axis=1)
    first, legs = (np.maximum(_LEG_TIME * np.sqrt(leg), leg * unit / top_speed) for leg in route.legs())
    guess = route.goals_after(first, legs, duration_s * unit)
    progress = np.zeros(route.episodes)
    order = np.argsort(guess, kind="stable")
    for begin in range(0, len(order), _BATCH):
        some = order[begin : begin + _BATCH]
        progress[some] = _progress(
            route, some, start[some], guess[some], radius, top_speed / unit, duration_s * unit
        )
    return Bound(np.floor(progress).astype(int).reshape(route.shape), progress.reshape(route.shape))


def _progress(
    route: Route,
    episodes: np.ndarray,
    start: np.ndarray,
    guess: np.ndarray,
    radius: float,
    top_speed: float,
    duration: float,
) -> np.ndarray:
    """Go up and down in the number of waypoints until one is in time and the next is late."""
    in_time, late = np.zeros(len(episodes), dtype=int), np.full(len(episodes), np.inf)
    share = np.zeros(len(episodes))
    goals, todo = guess.copy(), np.arange(len(episodes))
    while todo.size:
        number = goals[todo]
        tour = DiscTour(
            start[todo].T, route.centres(episodes[todo], int(number.max())), number, radius, top_speed
        )
        times = np.concatenate((np.zeros((1, len(todo))), least_times(tour)))
        last, before = (np.take_along_axis(times, (number - i)[None], axis=0)[0] for i in (0, 1))
        reached = last <= duration
        late[todo] = np.where(reached, late[todo], number)
        share[todo] = np.where(reached, share[todo], (duration - before) / np.maximum(last - before, 1e-12))
        passed = np.sum(times[1:] <= duration, axis=0)  # also those of a late plan are in time
        in_time[todo] = np.maximum(in_time[todo], passed)
        more = np.clip(np.floor((duration - last) * number / np.maximum(last, 1e-12)), 1, number + 1)
        wanted = np.where(reached, number + more, in_time[todo] + 1)
        goals[todo] = np.clip(wanted, in_time[todo] + 1, np.minimum(late[todo] - 1, route.most))
        todo = todo[(in_time[todo] + 1 < late[todo]) & (in_time[todo] < route.most)]
    return in_time + np.where(in_time < route.most, np.clip(share, 0.0, 1.0 - 1e-9), 0.0)
