"""Reach a position without touching what stands in the way, and stay there."""

from __future__ import annotations

import functools
from dataclasses import dataclass, fields, replace
from typing import ClassVar, Literal

from fulmar_core.robots.robot import Robot
from fulmar_core.states.arrays import array_namespace, clip
from fulmar_core.states.counter_rng import Draws
from fulmar_core.states.planar import PlanarState, to_body
from fulmar_core.states.rotation import Array
from fulmar_core.tasks.go_to_position import GoToPosition, PositionReward
from fulmar_core.tasks.goal import Goal, offset_to
from fulmar_core.tasks.obstacles import TOUCH, Obstacles, clearance
from fulmar_core.tasks.shortest_paths import shortest_way
from fulmar_core.tasks.task import FileTask
from fulmar_core.tasks.terms import (
    MOTION_TERMS,
    Errors,
    Start,
    fine_terms,
    motion_terms,
    pose_errors,
)

WAY_TERMS = ("way_x_in_body", "way_y_in_body")  # in the direction to take, as long as the way
FINE_WAY_TERMS = ("fine_way_x_in_body", "fine_way_y_in_body", "way_length")


@dataclass(frozen=True)
class GoToPositionWithObstacles(FileTask[PlanarState]):
    """Go to a position around discs; the goal arrives on `goal_point`, the discs on `obstacles`."""

    kind: Literal["go_to_position_with_obstacles"]
    start: Start
    obstacles: Obstacles
    fine_distance: float  # where the magnified position saturates [m]
    reward_weights: PositionReward
    collision_cost: float  # of touching, which ends an episode of training
    nearness_cost: float  # times exp(-clearance / 0.15 m): learned before the first touch

    goal_topic: ClassVar[str] = "goal_point"
    sees_obstacles: ClassVar[bool] = True

    @functools.cached_property
    def observation_names(self) -> tuple[str, ...]:
        """Terms of `GoToPosition`, of the way instead of the goal itself, then those of the obstacles."""
        return (*WAY_TERMS, *MOTION_TERMS, *FINE_WAY_TERMS, *self.obstacles.terms)

    @functools.cached_property
    def _plain(self) -> GoToPosition:
        shared = {each.name: getattr(self, each.name) for each in fields(GoToPosition) if each.name != "kind"}
        return GoToPosition("go_to_position", **shared)

    def draw(self, draws: Draws, robot: Robot, *, training: bool) -> tuple[PlanarState, Goal]:
        """Draw starts, goals and obstacles; see `Task.draw`."""
        start, goal = self._plain.draw(draws, robot, training=training)
        discs = self.obstacles.draw(draws, robot, start, goal.current)
        return start, self.surveyed(replace(goal, obstacles=discs), robot)

    def surveyed(self, goal: Goal, robot: Robot) -> Goal:
        """A batch of goals, as NumPy, whose obstacles are just discs, with the ways around them for a robot."""
        return replace(goal, obstacles=self.obstacles.survey(goal.obstacles, goal.current, robot))

    def observe(self, state: PlanarState, goal: Goal) -> tuple[Array, ...]:
        """What every controller of this task sees; see `Task.observe`."""
        x, y = self.way_in_body(state, goal)
        fine = fine_terms(x, y, saturation=self.fine_distance)
        return (x, y, *motion_terms(state), *fine, *self.obstacles.observe(state, goal.obstacles))

    def way_in_body(self, state: PlanarState, goal: Goal) -> tuple[Array, Array]:
        """Direction to take around the obstacles, as long as the whole way, in the body's frame, shapes (...,) [m]."""
        x, y, length = _way(state, goal)
        return to_body(state.yaw, length * x, length * y)

    def reward(self, before: PlanarState, after: PlanarState, goal: Goal, ended: Goal) -> Array:
        """Reward of one control step; see `Task.reward`."""
        return self.reward_weights.of(_way(before, goal)[2], _way(after, goal)[2], abs(after.yaw_rate))

    def errors(self, state: PlanarState, goal: Goal) -> Errors:
        """Distance from the goal."""
        return pose_errors(state, goal.current, heading=False)

    def collides(self, state: PlanarState, goal: Goal, robot: Robot) -> Array | None:
        """Whether the robot is at an obstacle."""
        return clearance(state, goal.obstacles, robot) < TOUCH

    def penalty(self, state: PlanarState, goal: Goal, robot: Robot) -> Array:
        """What being near an obstacle costs a learner; see `Task.penalty`."""
        gap = clearance(state, goal.obstacles, robot)
        xp = array_namespace(gap)
        touching = xp.astype(gap < TOUCH, gap.dtype)
        return self.collision_cost * touching + self.nearness_cost * xp.exp(-clip(gap, 0.0, 9.0) / 0.15)


def _way(state: PlanarState, goal: Goal) -> tuple[Array, Array, Array]:
    """Unit vector in the world along the way around the obstacles, and its length [m], shapes (...,)."""
    x, y = (goal.obstacles[..., i] - position[..., None] for i, position in enumerate((state.x, state.y)))
    return shortest_way(x, y, goal.obstacles, offset_to(state, goal.current))
