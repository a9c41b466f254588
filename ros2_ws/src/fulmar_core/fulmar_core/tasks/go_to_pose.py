"""Reach a position and a heading, and stay there."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

from fulmar_core.arrays import array_namespace
from fulmar_core.counter_rng import Draws
from fulmar_core.goal import Goal, no_obstacles
from fulmar_core.planar import PlanarState
from fulmar_core.robot import Robot
from fulmar_core.rotation import Array
from fulmar_core.tasks.terms import (
    FINE_TERMS,
    HEADING_TERMS,
    MOTION_TERMS,
    POSITION_TERMS,
    Errors,
    Start,
    Tolerance,
    fine_terms,
    goal_terms,
    heading_terms,
    motion_terms,
    pose_errors,
)


@dataclass(frozen=True)
class PoseReward:
    """Weights of the reward, per control step."""

    position: float  # times exp(-d / 0.25 m): thesis §3.5.1, S_p = 0.5 and lambda = 0.25
    heading: float  # times exp(-|e| / 0.25 rad): same
    far: float  # times exp(-d / 2 m): leads in from metres away
    joint: float  # times exp(-d / 0.1 m - |e| / 0.15 rad): asks for both at once
    joint_far: float  # times exp(-d / 1 m - |e| / 1 rad): RoboRAN tasks_cfg/go_to_pose_cfg.py
    facing: float  # times exp(-d / 1 m) (1 + cos e) / 2: no plateau at a quarter turn, once there
    approach: float  # times metres come nearer
    turn: float  # times radians come nearer


@dataclass(frozen=True)
class GoToPose:
    """Go to a pose in the plane; the goal arrives on `goal_pose`."""

    kind: Literal["go_to_pose"]
    name: str
    title: str
    episode_s: float  # length of an episode [s]
    start: Start
    tolerance: Tolerance
    fine_distance: float  # where the magnified position saturates [m]
    reward_weights: PoseReward

    goal_topic: ClassVar[str] = "goal_pose"
    observation_names: ClassVar[tuple[str, ...]] = (
        *POSITION_TERMS,
        *HEADING_TERMS,
        *MOTION_TERMS,
        *FINE_TERMS,
    )

    def draw(self, draws: Draws, robot: Robot, *, training: bool) -> tuple[PlanarState, Goal]:
        """Draw starts and goals; see `TaskProtocol.draw`."""
        start, target = self.start.draw(draws, training=training)
        zero = array_namespace(target).zeros_like(start.x)
        return start, Goal(target[:, None, :], zero, no_obstacles(draws.worlds), target[:, :2] * 0.0)

    def observe(self, state: PlanarState, goal: Goal) -> tuple[Array, ...]:
        """What every controller of this task sees; see `TaskProtocol.observe`."""
        x, y = goal_terms(state, goal.current)
        fine = fine_terms(x, y, saturation=self.fine_distance)
        return (x, y, *heading_terms(state, goal.current), *motion_terms(state), *fine)

    def advance(self, goal: Goal, state: PlanarState, time_s: Array) -> Goal:
        """The goal stays."""
        return goal

    def reward(self, before: PlanarState, after: PlanarState, goal: Goal) -> Array:
        """Reward of one control step; see `TaskProtocol.reward`."""
        old, new = self.errors(before, goal), self.errors(after, goal)
        xp = array_namespace(after.x)
        w = self.reward_weights
        d, e = new.position, xp.abs(new.heading)
        return (
            w.position * xp.exp(-d / 0.25)
            + w.heading * xp.exp(-e / 0.25)
            + w.far * xp.exp(-d / 2.0)
            + w.joint * xp.exp(-d / 0.1 - e / 0.15)
            + w.joint_far * xp.exp(-d - e)
            + w.facing * xp.exp(-d) * 0.5 * (1.0 + xp.cos(e))
            + w.approach * (old.position - d)
            + w.turn * (xp.abs(old.heading) - e)
        )

    def errors(self, state: PlanarState, goal: Goal) -> Errors:
        """Distance from the goal, and heading error."""
        return pose_errors(state, goal.current, heading=True)

    def collides(self, state: PlanarState, goal: Goal, robot: Robot) -> Array | None:
        """Nothing stands about."""
        return None
