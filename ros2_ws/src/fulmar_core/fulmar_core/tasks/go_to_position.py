"""Reach a position, whatever the heading, and stay there."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

from array_api_compat import array_namespace

from fulmar_core.rotation import Array
from fulmar_core.state import Pose, RigidBodyState
from fulmar_core.tasks.planar import (
    FINE_TERMS,
    MOTION_TERMS,
    POSITION_TERMS,
    Start,
    Tolerance,
    fine_terms,
    goal_and_motion_in_body,
    planar_error,
)


@dataclass(frozen=True)
class PositionReward:
    """Weights of the reward, per control step."""

    position: float  # times exp(-d / 0.25 m): RANS cfg/task/reward/*.yaml
    far: float  # times exp(-d / 2 m): leads in from metres away
    near: float  # times exp(-d / 0.1 m): asks for centimetres
    approach: float  # times metres come nearer
    spin: float  # cost of the turn rate [per rad/s]
    open_valve: float  # cost of each actuator in use


@dataclass(frozen=True)
class GoToPosition:
    """Go to a position in the plane; the goal arrives on `goal_point`."""

    kind: Literal["go_to_position"]
    name: str
    title: str
    episode_s: float  # length of an episode [s]
    start: Start
    tolerance: Tolerance
    fine_distance: float  # where the magnified position saturates [m]
    reward_weights: PositionReward

    goal_topic: ClassVar[str] = "goal_point"
    observation_names: ClassVar[tuple[str, ...]] = (*POSITION_TERMS, *MOTION_TERMS, *FINE_TERMS)

    def observe(self, state: RigidBodyState, goal: Pose) -> Array:
        """What every controller of this task sees, in training and on the robot.

        Args:
            state: Measured state.
            goal: Goal; its heading does not matter.

        Returns:
            Terms in the order of `observation_names`, shape (..., 8).
        """
        xp = array_namespace(state.position_in_world)
        offset, motion = goal_and_motion_in_body(state, goal)
        return xp.concat((offset, motion, fine_terms(offset, saturation=self.fine_distance)), axis=-1)

    def reward(self, before: RigidBodyState, after: RigidBodyState, goal: Pose, command: Array) -> Array:
        """Reward of one control step; arguments and shape as in `GoToPose.reward`."""
        xp = array_namespace(command)
        w = self.reward_weights
        old, d = planar_error(before, goal).position, planar_error(after, goal).position
        return (
            w.position * xp.exp(-d / 0.25)
            + w.far * xp.exp(-d / 2.0)
            + w.near * xp.exp(-d / 0.1)
            + w.approach * (old - d)
            - w.spin * xp.abs(after.angular_velocity_in_body[..., 2])
            - w.open_valve * xp.sum(xp.abs(command), axis=-1)
        )
