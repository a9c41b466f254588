"""Reach a position and an attitude in space, and stay there."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

from fulmar_core.robots.robot import Robot
from fulmar_core.states.arrays import array_namespace
from fulmar_core.states.counter_rng import Draws
from fulmar_core.states.rotation import Array
from fulmar_core.states.spatial import SpatialState
from fulmar_core.tasks.goal import Goal, goals_at
from fulmar_core.tasks.space_terms import (
    ATTITUDE_TERMS,
    FINE_ATTITUDE_TERMS,
    FINE_TERMS,
    MOTION_TERMS,
    POSITION_TERMS,
    ROTATION_TERMS,
    SpaceStart,
    attitude_terms,
    fine_attitude_terms,
    fine_terms,
    goal_terms,
    motion_terms,
    place_errors,
    rotation_terms,
)
from fulmar_core.tasks.task import FileTask
from fulmar_core.tasks.terms import Errors, weighted_sum


@dataclass(frozen=True)
class SpacePoseReward:
    """Weights of the reward, per control step; d is the distance, e the angle to the goal's attitude."""

    position: float  # times exp(-d / 0.25 m): RANS 3-D GoToPose
    attitude: float  # times exp(-e / 0.25 rad): same
    far: float  # times exp(-d / 2 m): leads in from metres away
    facing: float  # times (1 + cos e) / 2: no plateau far from the attitude
    joint: float  # times exp(-d / 0.1 m - e / 0.15 rad): asks for both at once
    approach: float  # times metres come nearer
    turn: float  # times radians come nearer
    fine: float = 0.0  # times exp(-d / 0.03 m - e / 0.03 rad): asks for a centimetre and a degree at once


@dataclass(frozen=True)
class GoToPose3d(FileTask[SpatialState]):
    """Go to a pose in space; the goal arrives on `goal_pose`."""

    kind: Literal["go_to_pose_3d"]
    start: SpaceStart
    fine_distance: float  # where the magnified position saturates [m]
    fine_angle: float  # where the magnified attitude error saturates [rad]
    reward_weights: SpacePoseReward

    goal_topic: ClassVar[str] = "goal_pose"
    state_type = SpatialState
    observation_names: ClassVar[tuple[str, ...]] = (
        *POSITION_TERMS,
        *FINE_TERMS,
        *ATTITUDE_TERMS,
        *FINE_ATTITUDE_TERMS,
        *MOTION_TERMS,
        *ROTATION_TERMS,
    )

    def draw(self, draws: Draws, robot: Robot, *, training: bool) -> tuple[SpatialState, Goal]:
        """Draw starts and goals; see `Task.draw`."""
        start, target = self.start.draw_in_space(draws, training=training, tilt_deg=robot.kind.tilt_deg)
        return start, goals_at(target)

    def observe(self, state: SpatialState, goal: Goal) -> tuple[Array, ...]:
        """What every controller of this task sees; see `Task.observe`."""
        target = goal.current
        way, error = goal_terms(state, target), attitude_terms(state, target)
        return (
            *way,
            *fine_terms(way, saturation=self.fine_distance),
            *error,
            *fine_attitude_terms(error, saturation=self.fine_angle),
            *motion_terms(state),
            *rotation_terms(state, target),
        )

    def reward(self, before: SpatialState, after: SpatialState, goal: Goal, ended: Goal) -> Array:
        """Reward of one control step; see `Task.reward`."""
        old, new = self.errors(before, goal), self.errors(after, goal)
        xp, w = array_namespace(after.x), self.reward_weights
        d, e = new.position, new.attitude
        return weighted_sum(
            (w.position, lambda: xp.exp(-d / 0.25)),
            (w.attitude, lambda: xp.exp(-e / 0.25)),
            (w.far, lambda: xp.exp(-d / 2.0)),
            (w.facing, lambda: 0.5 * (1.0 + xp.cos(e))),
            (w.joint, lambda: xp.exp(-d / 0.1 - e / 0.15)),
            (w.approach, lambda: old.position - d),
            (w.turn, lambda: old.attitude - e),
            (w.fine, lambda: xp.exp(-d / 0.03 - e / 0.03)),
            zero=xp.zeros_like(d),
        )

    def errors(self, state: SpatialState, goal: Goal) -> Errors:
        """Distance from the goal, and angle to its attitude."""
        return place_errors(state, goal.current, attitude=True)
