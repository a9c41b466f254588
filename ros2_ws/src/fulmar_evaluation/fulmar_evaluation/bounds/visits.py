"""Visiting waypoints in order: what counts, and the order itself."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, slots=True)
class Bound:
    """How many waypoints can be visited at most."""

    goals: np.ndarray  # (...,) whole waypoints
    progress: np.ndarray  # (...,) >= goals, with the share of the way to the next one


def goals_reached(
    trajectory_xy: np.ndarray, waypoints: np.ndarray, *, radius: float, loop: bool = True
) -> np.ndarray:
    """How many waypoints a trajectory visits in order; at most one a sample.

    Args:
        trajectory_xy: Positions at the control steps, shape (..., T, 2) [m].
        waypoints: Shape (..., K, 2) [m].
        radius: A waypoint is visited by a sample nearer than this [m].
        loop: The first comes after the last again.

    Returns:
        Visits, shape (...,).
    """
    count = waypoints.shape[-2]
    lead = np.broadcast_shapes(trajectory_xy.shape[:-2], waypoints.shape[:-2])
    waypoints = np.broadcast_to(waypoints, (*lead, count, 2))
    visits = np.zeros(lead, dtype=int)
    for step in range(trajectory_xy.shape[-2]):
        current = np.take_along_axis(waypoints, (visits % count)[..., None, None], axis=-2)[..., 0, :]
        near = np.linalg.norm(current - trajectory_xy[..., step, :], axis=-1) < radius
        visits += near & (loop | (visits < count))
    return visits


@dataclass(frozen=True, slots=True)
class Route:
    """Where episodes start and what they visit, with the leading axes of the callers made one."""

    start: np.ndarray  # (E, 2)
    waypoints: np.ndarray  # (E, K, 2)
    loop: bool
    shape: tuple[int, ...]  # the leading axes

    @property
    def episodes(self) -> int:
        """Number of episodes."""
        return len(self.start)

    @property
    def most(self) -> float:
        """Most visits that there are."""
        return math.inf if self.loop else self.waypoints.shape[1]

    def centres(self, episodes: np.ndarray, goals: int) -> np.ndarray:
        """The first so many waypoints to visit, shape (goals, 2, E)."""
        order = np.arange(goals) % self.waypoints.shape[1]
        return np.ascontiguousarray(self.waypoints[episodes][:, order].transpose(1, 2, 0))

    def legs(self) -> tuple[np.ndarray, np.ndarray]:
        """Distance to the first waypoint (E,), and from each to the next in the loop (E, K) [m]."""
        first = np.linalg.norm(self.waypoints[:, 0] - self.start, axis=-1)
        return first, np.linalg.norm(np.roll(self.waypoints, -1, axis=1) - self.waypoints, axis=-1)

    def goals_after(self, costs_first: np.ndarray, costs: np.ndarray, budget: float) -> np.ndarray:
        """First number of visits whose costs exceed a budget, shape (E,), at most `most`.

        Args:
            costs_first: Cost of the way to the first waypoint, shape (E,).
            costs: Cost of each leg of the loop, shape (E, K).
            budget: What there is.
        """
        left, lap = budget - costs_first, np.sum(costs, axis=1)
        laps = np.maximum(np.floor(left / lap), 0.0) if self.loop else np.zeros(self.episodes)
        legs = costs if self.loop else costs[:, :-1]
        within = np.sum(np.cumsum(legs, axis=1) <= (left - laps * lap)[:, None], axis=1)
        goals = 1 + laps * costs.shape[1] + within + (left >= 0.0)
        return np.asarray(np.minimum(goals, self.most).astype(int))


def route_of(
    start_xy: np.ndarray, waypoints: np.ndarray, *, radius: float, duration_s: float, loop: bool
) -> Route:
    """Check and flatten the arguments of a bound.

    Raises:
        ValueError: Something is not positive, or the waypoints can be visited for ever in no time.
    """
    if not (radius > 0.0 and duration_s > 0.0):
        raise ValueError("'radius' and 'duration_s' must be greater than 0.")
    count = waypoints.shape[-2]
    lead = np.broadcast_shapes(start_xy.shape[:-1], waypoints.shape[:-2])
    route = Route(
        np.broadcast_to(start_xy, (*lead, 2)).reshape(-1, 2).astype(float),
        np.broadcast_to(waypoints, (*lead, count, 2)).reshape(-1, count, 2).astype(float),
        loop,
        lead,
    )
    if loop and np.any(np.max(route.legs()[1], axis=1) <= 2.0 * radius):
        raise ValueError(
            "waypoints of a loop must not all lie within reach of one another: their number has no bound."
        )
    return route
