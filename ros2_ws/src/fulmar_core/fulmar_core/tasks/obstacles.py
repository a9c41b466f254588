"""Discs as obstacles: where they are drawn, how controllers observe them, and what counts as touching."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from array_api_compat import device

from fulmar_core.dynamics.contact import outline_of
from fulmar_core.robots.robot import Robot
from fulmar_core.states.arrays import array_namespace, clip
from fulmar_core.states.counter_rng import Draws
from fulmar_core.states.planar import PlanarState, to_body
from fulmar_core.states.rotation import Array
from fulmar_core.tasks.shortest_paths import survey

CANDIDATES = 8  # places tried for each obstacle; one that fits nowhere is left out
FAR = 1e3  # where an obstacle is that is not there [m]
SIGHT = 3.0  # longest vector to an obstacle in an observation [m]
TOUCH = 0.01  # nearer than this counts as touching; contacts of simulators are as soft [m]


@dataclass(frozen=True)
class Obstacles:
    """How many, how large, and how far from what (RoboRAN tasks_cfg/go_to_position_with_obstacles_cfg.py)."""

    most: int  # drawn for an episode; at least one is tried
    radius: float  # [m]
    height: float  # for simulators that have one [m]
    from_goal: float  # least distance of the centre [m]
    from_start: float  # same [m]
    apart: float  # least distance between two centres [m]
    margin: float  # that ways around keep between outline and edge [m]
    seen: int  # how many of the nearest a controller sees

    @property
    def terms(self) -> tuple[str, ...]:
        """Names of the observation terms."""
        parts = ("x_in_body", "y_in_body", "closeness")
        return tuple(f"obstacle_{i + 1}_{part}" for i in range(self.seen) for part in parts)

    def draw(self, draws: Draws, robot: Robot, start: PlanarState, target: np.ndarray) -> np.ndarray:
        """Draw obstacles between and around start and goal.

        Args:
            draws: One row for each episode.
            robot: Its outline keeps clear of them at the start and at the goal.
            start: Starts.
            target: Goals, shape (worlds, 3).

        Returns:
            Shape (worlds, most, 3): x [m], y [m] and radius [m], which is 0 for those that are not there.
        """
        n = draws.worlds
        begin, end = np.stack((start.x, start.y), axis=-1), np.asarray(target)[:, :2]
        middle, reach = 0.5 * (begin + end), 0.75 * np.linalg.norm(end - begin, axis=-1)
        clear = outline_of(robot).extent + self.radius + 0.2
        wanted = np.asarray(draws.uniform(1.0, self.most + 1.0))
        placed = np.zeros((n, self.most, 3))
        for i in range(self.most):
            distance = reach[:, None] * np.sqrt(np.asarray(draws.uniform(0.0, 1.0, CANDIDATES)))
            angle = np.asarray(draws.uniform(-math.pi, math.pi, CANDIDATES))
            spots = middle[:, None] + distance[..., None] * np.stack((np.cos(angle), np.sin(angle)), -1)
            fits = np.linalg.norm(spots - begin[:, None], axis=-1) >= max(self.from_start, clear)
            fits &= np.linalg.norm(spots - end[:, None], axis=-1) >= max(self.from_goal, clear)
            gaps = np.linalg.norm(spots[:, :, None] - placed[:, None, :i, :2], axis=-1)
            fits &= np.all((gaps >= self.apart) | (placed[:, None, :i, 2] == 0.0), axis=-1)
            pick = np.argmax(fits, axis=1)
            there = fits[np.arange(n), pick] & (i + 1.0 <= wanted)
            placed[:, i, :2] = spots[np.arange(n), pick]
            placed[:, i, 2] = np.where(there, self.radius, 0.0)
        return placed

    def survey(self, discs: np.ndarray, target: np.ndarray, robot: Robot) -> np.ndarray:
        """Discs with the ways around them for a robot; see `fulmar_core.tasks.shortest_paths.survey`."""
        return survey(discs[..., :3], target[..., :2], self.clearance(robot))

    def clearance(self, robot: Robot) -> float:
        """What ways keep between the body's centre and an edge, so that the robot may turn anywhere [m]."""
        return outline_of(robot).extent + self.margin

    def observe(self, state: PlanarState, obstacles: Array) -> tuple[Array, ...]:
        """Where the nearest obstacles are, seen from the body.

        Args:
            state: Measured state.
            obstacles: Shape (..., m, 3).

        Returns:
            `3 seen` terms of shape (...,): the vector to the centre, no longer than `SIGHT` [m], and exp(-gap / 0.5 m)
            [-]. One that is not there lies at the end of sight behind the robot, with a closeness of 0.
        """
        xp = array_namespace(state.x)
        x, y, gap = _relative(state, obstacles)
        missing = self.seen - obstacles.shape[-2]
        if missing > 0:
            pad = xp.zeros((*x.shape[:-1], missing), dtype=x.dtype, device=device(x))
            x, y, gap = (xp.concat((a, pad + b), axis=-1) for a, b in ((x, -FAR), (y, 0.0), (gap, FAR)))
        order = xp.argsort(gap, axis=-1)[..., : self.seen]
        x, y, gap = (xp.take_along_axis(a, order, axis=-1) for a in (x, y, gap))
        there = gap < FAR
        shrink = SIGHT / clip(xp.sqrt(x * x + y * y), SIGHT, None)
        columns = (
            xp.where(there, x * shrink, xp.full_like(x, -SIGHT)),
            xp.where(there, y * shrink, xp.zeros_like(y)),
            xp.exp(-clip(gap, -1.0, 50.0) / 0.5),
        )
        return tuple(column[..., i] for i in range(self.seen) for column in columns)


def clearance(state: PlanarState, obstacles: Array, robot: Robot) -> Array:
    """How far the robot's outline is from the nearest obstacle.

    Args:
        state: True state, shapes (...,).
        obstacles: Shape (..., m, 3), m >= 1.
        robot: Its outline: a box, or a disc.

    Returns:
        Distance, negative inside, 1 km or so where there is none, shape (...,) [m].
    """
    xp = array_namespace(state.x)
    x, y, gap = _relative(state, obstacles)
    there = obstacles[..., 2] > 0.0
    return xp.min(xp.where(there, outline_of(robot).gap(x, y) - obstacles[..., 2], gap), axis=-1)


def _relative(state: PlanarState, obstacles: Array) -> tuple[Array, Array, Array]:
    """Centres in the body's frame, and gaps between the body's centre and the discs, shapes (..., m) [m]."""
    xp = array_namespace(state.x)
    dx = obstacles[..., 0] - state.x[..., None]
    dy = obstacles[..., 1] - state.y[..., None]
    x, y = to_body(state.yaw[..., None], dx, dy)
    gap = xp.sqrt(dx * dx + dy * dy) - obstacles[..., 2]
    return x, y, xp.where(obstacles[..., 2] > 0.0, gap, xp.full_like(gap, FAR))
