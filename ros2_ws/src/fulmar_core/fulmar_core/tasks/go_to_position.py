"""Reach a position, whatever the heading, and stay there."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

from fulmar_core.robots.robot import Robot
from fulmar_core.states.arrays import array_namespace
from fulmar_core.states.counter_rng import Draws
from fulmar_core.states.planar import PlanarState
from fulmar_core.states.rotation import Array
from fulmar_core.tasks.goal import Goal, goals_at
from fulmar_core.tasks.task import FileTask
from fulmar_core.tasks.terms import (
    FINE_TERMS,
    MOTION_TERMS,
    POSITION_TERMS,
    Errors,
    Start,
    fine_terms,
    goal_terms,
    motion_terms,
    pose_errors,
)


@dataclass(frozen=True)
class PositionReward:
    """Weights of the reward, per control step."""

    position: float  # times exp(-d / 0.25 m): RANS cfg/task/reward/*.yaml
    far: float  # times exp(-d / 2 m): leads in from metres away
    near: float  # times exp(-d / 0.1 m): asks for centimetres
    approach: float  # times metres come nearer
    spin: float  # cost of the turn rate [per rad/s]

    def of(self, old: Array, d: Array, spin: Array) -> Array:
        """Reward of having come from a distance to another [m], at a turn rate of some size, shape (...,)."""
        xp = array_namespace(d)
        return (
            self.position * xp.exp(-d / 0.25)
            + self.far * xp.exp(-d / 2.0)
            + self.near * xp.exp(-d / 0.1)
            + self.approach * (old - d)
            - self.spin * spin
        )


@dataclass(frozen=True)
class GoToPosition(FileTask[PlanarState]):
    """Go to a position in the plane; the goal arrives on `goal_point`."""

    kind: Literal["go_to_position"]
    start: Start
    fine_distance: float  # where the magnified position saturates [m]
    reward_weights: PositionReward

    goal_topic: ClassVar[str] = "goal_point"
    observation_names: ClassVar[tuple[str, ...]] = (*POSITION_TERMS, *MOTION_TERMS, *FINE_TERMS)

    def draw(self, draws: Draws, robot: Robot, *, training: bool) -> tuple[PlanarState, Goal]:
        """Draw starts and goals; see `Task.draw`."""
        start, target = self.start.draw(draws, training=training)
        return start, goals_at(target)

    def observe(self, state: PlanarState, goal: Goal) -> tuple[Array, ...]:
        """What every controller of this task sees; see `Task.observe`."""
        x, y = goal_terms(state, goal.current)
        return (x, y, *motion_terms(state), *fine_terms(x, y, saturation=self.fine_distance))

    def reward(self, before: PlanarState, after: PlanarState, goal: Goal, ended: Goal) -> Array:
        """Reward of one control step; see `Task.reward`."""
        old, new = self.errors(before, goal).position, self.errors(after, goal).position
        return self.reward_weights.of(old, new, abs(after.yaw_rate))

    def errors(self, state: PlanarState, goal: Goal) -> Errors:
        """Distance from the goal."""
        return pose_errors(state, goal.current, heading=False)
