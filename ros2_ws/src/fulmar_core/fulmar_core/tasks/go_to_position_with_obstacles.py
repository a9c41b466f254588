"""Reach a position without touching what stands in the way, and stay there."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import ClassVar, Literal

from array_api_compat import array_namespace

from fulmar_core.arrays import clip
from fulmar_core.counter_rng import Draws
from fulmar_core.goal import Goal
from fulmar_core.planar import PlanarState
from fulmar_core.robot import Robot
from fulmar_core.rotation import Array
from fulmar_core.tasks.go_to_position import GoToPosition, PositionReward
from fulmar_core.tasks.obstacles import TOUCH, Obstacles, clearance
from fulmar_core.tasks.terms import Errors, Start, Tolerance, pose_errors


@dataclass(frozen=True)
class GoToPositionWithObstacles:
    """Go to a position around discs; the goal arrives on `goal_point`, the discs on `obstacles`."""

    kind: Literal["go_to_position_with_obstacles"]
    name: str
    title: str
    episode_s: float  # length of an episode [s]
    start: Start
    obstacles: Obstacles
    tolerance: Tolerance
    fine_distance: float  # where the magnified position saturates [m]
    reward_weights: PositionReward
    collision_cost: float  # of touching, which ends an episode of training
    nearness_cost: float  # times exp(-clearance / 0.15 m): learned before the first touch

    goal_topic: ClassVar[str] = "goal_point"

    @functools.cached_property
    def observation_names(self) -> tuple[str, ...]:
        """Terms of `GoToPosition`, then those of the obstacles."""
        return (*GoToPosition.observation_names, *self.obstacles.terms)

    @functools.cached_property
    def _plain(self) -> GoToPosition:
        return GoToPosition(
            "go_to_position", self.name, self.title, self.episode_s, self.start, self.tolerance,
            self.fine_distance, self.reward_weights,
        )  # fmt: skip

    def draw(self, draws: Draws, robot: Robot, *, training: bool) -> tuple[PlanarState, Goal]:
        """Draw starts, goals and obstacles; see `TaskProtocol.draw`."""
        start, goal = self._plain.draw(draws, robot, training=training)
        discs = self.obstacles.draw(draws, robot, start, goal.current)
        return start, Goal(goal.targets, goal.done, discs, goal.block)

    def observe(self, state: PlanarState, goal: Goal) -> tuple[Array, ...]:
        """What every controller of this task sees; see `TaskProtocol.observe`."""
        return (*self._plain.observe(state, goal), *self.obstacles.observe(state, goal.obstacles))

    def advance(self, goal: Goal, state: PlanarState, time_s: Array) -> Goal:
        """The goal stays."""
        return goal

    def reward(self, before: PlanarState, after: PlanarState, goal: Goal) -> Array:
        """Reward of one control step; see `TaskProtocol.reward`."""
        return self._plain.reward(before, after, goal)

    def errors(self, state: PlanarState, goal: Goal) -> Errors:
        """Distance from the goal."""
        return pose_errors(state, goal.current, heading=False)

    def collides(self, state: PlanarState, goal: Goal, robot: Robot) -> Array | None:
        """Whether the robot is at an obstacle."""
        return clearance(state, goal.obstacles, robot) < TOUCH

    def penalty(self, state: PlanarState, goal: Goal, robot: Robot) -> Array:
        """What being near an obstacle costs a learner; see `TaskProtocol.penalty`."""
        gap = clearance(state, goal.obstacles, robot)
        xp = array_namespace(gap)
        touching = xp.astype(gap < TOUCH, gap.dtype)
        return self.collision_cost * touching + self.nearness_cost * xp.exp(-clip(gap, 0.0, 9.0) / 0.15)
