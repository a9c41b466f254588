"""Reach a position and a heading, and stay there."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

from array_api_compat import array_namespace

from fulmar_core.rotation import Array
from fulmar_core.state import Pose, RigidBodyState
from fulmar_core.tasks.planar import (
    FINE_TERMS,
    HEADING_TERMS,
    MOTION_TERMS,
    POSITION_TERMS,
    Start,
    Tolerance,
    fine_terms,
    goal_and_motion_in_body,
    heading_terms,
    planar_error,
)


@dataclass(frozen=True)
class PoseReward:
    """Weights of the reward, per control step."""

    position: float  # times exp(-d / 0.25 m): thesis §3.5.1, S_p = 0.5 and lambda = 0.25
    heading: float  # times exp(-|e| / 0.25 rad): same
    far: float  # times exp(-d / 2 m): leads in from metres away
    joint: float  # times exp(-d / 0.1 m - |e| / 0.15 rad): asks for both at once
    facing: float  # times (1 + cos e) / 2: no plateau at a quarter turn
    approach: float  # times metres come nearer
    turn: float  # times radians come nearer
    open_valve: float  # cost of each actuator in use


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

    def observe(self, state: RigidBodyState, goal: Pose) -> Array:
        """What every controller of this task sees, in training and on the robot.

        Args:
            state: Measured state.
            goal: Goal pose.

        Returns:
            Terms in the order of `observation_names`, shape (..., 10).
        """
        xp = array_namespace(state.position_in_world)
        offset, motion = goal_and_motion_in_body(state, goal)
        fine = fine_terms(offset, saturation=self.fine_distance)
        return xp.concat((offset, heading_terms(state, goal), motion, fine), axis=-1)

    def reward(self, before: RigidBodyState, after: RigidBodyState, goal: Pose, command: Array) -> Array:
        """Reward of one control step.

        Args:
            before: True state at its start.
            after: True state at its end.
            goal: Goal pose.
            command: Applied command, shape (..., n).

        Returns:
            Reward, shape (...,).
        """
        xp = array_namespace(command)
        w = self.reward_weights
        old, new = planar_error(before, goal), planar_error(after, goal)
        d, e = new.position, xp.abs(new.heading)
        return (
            w.position * xp.exp(-d / 0.25)
            + w.heading * xp.exp(-e / 0.25)
            + w.far * xp.exp(-d / 2.0)
            + w.joint * xp.exp(-d / 0.1 - e / 0.15)
            + w.facing * 0.5 * (1.0 + xp.cos(e))
            + w.approach * (old.position - d)
            + w.turn * (xp.abs(old.heading) - e)
            - w.open_valve * xp.sum(xp.abs(command), axis=-1)
        )
