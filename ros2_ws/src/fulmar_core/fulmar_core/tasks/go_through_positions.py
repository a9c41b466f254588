"""Visit waypoints one after another, as many as time allows."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np
from array_api_compat import array_namespace

from fulmar_core.counter_rng import Draws
from fulmar_core.goal import Goal, no_obstacles
from fulmar_core.planar import PlanarState, at_rest, wrapped
from fulmar_core.robot import Robot
from fulmar_core.rotation import Array
from fulmar_core.tasks.terms import MOTION_TERMS, Errors, Tolerance, goal_terms, motion_terms, pose_errors
from fulmar_core.tasks.waypoints import Course, headings_along

NEXT_TERMS = ("direction_x_in_body", "direction_y_in_body", "distance")


@dataclass(frozen=True)
class WaypointReward:
    """Weights of the reward, per control step."""

    progress: float  # times metres come nearer to the current waypoint
    reached: float  # for each waypoint reached
    bearing: float  # times exp(-|bearing of the waypoint| / 0.25 rad): RoboRAN tasks_cfg/go_through_positions_cfg.py
    spin: float  # cost of the turn rate [per rad/s]


@dataclass(frozen=True)
class GoThroughPositions:
    """Pass through positions in their order; they arrive on `goal_path`."""

    kind: Literal["go_through_positions"]
    name: str
    title: str
    episode_s: float  # length of an episode [s]
    start_distance: tuple[float, float]  # from the first waypoint [m]
    course: Course
    reach: float  # a controller takes a waypoint for reached within this, less than the tolerance [m]
    tolerance: Tolerance
    required: int  # waypoints that make an episode a success
    reward_weights: WaypointReward

    goal_topic: ClassVar[str] = "goal_path"
    heads: ClassVar[bool] = False
    observation_names: ClassVar[tuple[str, ...]] = (
        *MOTION_TERMS,
        *(f"goal_{name}" for name in NEXT_TERMS),
        *(f"next_goal_{name}" for name in NEXT_TERMS),
    )

    def __post_init__(self) -> None:
        """Refuse a reach that judges would not count."""
        if not 0.0 < self.reach <= self.tolerance.position:
            raise ValueError("'reach' must be greater than 0 and at most the tolerance of the position.")

    def draw(self, draws: Draws, robot: Robot, *, training: bool) -> tuple[PlanarState, Goal]:
        """Draw a start at rest and a closed course."""
        places = self.course.draw(draws)
        distance = np.asarray(draws.uniform(*self.start_distance))
        bearing = np.asarray(draws.uniform(-math.pi, math.pi))
        yaw = np.asarray(draws.uniform(-math.pi, math.pi))
        start = at_rest(
            places[:, 0, 0] + distance * np.cos(bearing), places[:, 0, 1] + distance * np.sin(bearing), yaw
        )
        targets = np.concatenate((places, headings_along(places)[..., None]), axis=-1)
        return start, Goal(targets, np.zeros(draws.worlds), no_obstacles(draws.worlds), places[:, 0] * 0.0)

    def observe(self, state: PlanarState, goal: Goal) -> tuple[Array, ...]:
        """What every controller of this task sees; see `TaskProtocol.observe`."""
        return (*motion_terms(state), *_toward(state, goal.ahead(0)), *_toward(state, goal.ahead(1)))

    def advance(self, goal: Goal, state: PlanarState, time_s: Array) -> Goal:
        """A waypoint within reach is done."""
        return self.counted(goal, state, self.reach)

    def counted(self, goal: Goal, state: PlanarState, radius: float) -> Goal:
        """The goal with one more waypoint done where the current one is within a radius [m]."""
        xp = array_namespace(state.x)
        near = self.errors(state, goal).position < radius
        done = goal.done + xp.astype(near, goal.done.dtype)
        return Goal(goal.targets, done, goal.obstacles, goal.block)

    def reward(self, before: PlanarState, after: PlanarState, goal: Goal) -> Array:
        """Reward of one control step; see `TaskProtocol.reward`."""
        xp = array_namespace(after.x)
        w = self.reward_weights
        old, new = self.errors(before, goal).position, self.errors(after, goal).position
        x, y = goal_terms(after, goal.current)
        bearing = xp.abs(wrapped(xp.atan2(y, x)))
        return (
            w.progress * (old - new)
            + w.reached * xp.astype(new < self.reach, new.dtype)
            + w.bearing * xp.exp(-bearing / 0.25)
            - w.spin * xp.abs(after.yaw_rate)
        )

    def errors(self, state: PlanarState, goal: Goal) -> Errors:
        """Distance from the current waypoint."""
        return pose_errors(state, goal.current, heading=False)

    def collides(self, state: PlanarState, goal: Goal, robot: Robot) -> Array | None:
        """Nothing stands about."""
        return None


def _toward(state: PlanarState, target: Array) -> tuple[Array, Array, Array]:
    """Direction of a target in the body's frame, and its distance [m], `NEXT_TERMS`."""
    xp = array_namespace(state.x)
    x, y = goal_terms(state, target)
    distance = xp.sqrt(x * x + y * y)
    safe = xp.clip(distance, 1e-3, None)
    return x / safe, y / safe, distance
