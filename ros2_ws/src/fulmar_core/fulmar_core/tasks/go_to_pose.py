"""Reach a position and a heading, and stay there."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, Literal

from fulmar_core.robots.robot import Robot
from fulmar_core.states.arrays import array_namespace, clip
from fulmar_core.states.counter_rng import Draws
from fulmar_core.states.planar import PlanarState, wrapped
from fulmar_core.states.rotation import Array
from fulmar_core.tasks.goal import Goal, goals_at
from fulmar_core.tasks.task import FileTask
from fulmar_core.tasks.terms import (
    FINE_TERMS,
    HEADING_TERMS,
    MOTION_TERMS,
    POSITION_TERMS,
    Errors,
    Start,
    fine_terms,
    goal_terms,
    heading_terms,
    motion_terms,
    pose_errors,
    weighted_sum,
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
    fine: float = 0.0  # times exp(-d / 0.03 m - |e| / 0.03 rad): asks for a centimetre and a degree at once
    turned: float = 0.0  # times (1 - tanh((|e| - 0.08 rad) / 0.02 rad)) / 2: asks for what counts as turned
    aligned: float = 0.0  # times exp(-|e| / 0.03 rad), wherever the robot is
    centred: float = 0.0  # times exp(-d / 0.03 m), wherever it looks


@dataclass(frozen=True)
class GoToPose(FileTask[PlanarState]):
    """Go to a pose in the plane; the goal arrives on `goal_pose`."""

    kind: Literal["go_to_pose"]
    start: Start
    fine_distance: float  # where the magnified position saturates [m]
    reward_weights: PoseReward
    fine_heading_deg: float = 0.0  # where the magnified heading error saturates; 0: not observed [deg]
    fine_speed: float = 0.0  # where magnified velocities saturate; 0: not observed [m/s]
    fine_yaw_rate: float = 0.0  # same of the turn rate; 0: not observed [rad/s]
    # Instead of `reward_weights`, in training, where all failures leave no pose to hold.
    stranded_weights: PoseReward | None = None  # word: key of task files

    goal_topic: ClassVar[str] = "goal_pose"

    def __post_init__(self) -> None:
        if min(self.fine_heading_deg, self.fine_speed, self.fine_yaw_rate) < 0.0:
            raise ValueError("'fine_heading_deg', 'fine_speed' and 'fine_yaw_rate' must not be negative.")

    @property
    def observation_names(self) -> tuple[str, ...]:
        """Where the goal is, how the robot moves, and both magnified near the goal."""
        heading = ("fine_heading_error",) if self.fine_heading_deg else ()
        speed = ("fine_velocity_x_in_body", "fine_velocity_y_in_body") if self.fine_speed else ()
        turning = ("fine_yaw_rate",) if self.fine_yaw_rate else ()
        return (*POSITION_TERMS, *HEADING_TERMS, *MOTION_TERMS, *FINE_TERMS, *heading, *speed, *turning)

    def draw(self, draws: Draws, robot: Robot, *, training: bool) -> tuple[PlanarState, Goal]:
        """Draw starts and goals; see `Task.draw`."""
        start, target = self.start.draw(draws, training=training)
        return start, goals_at(target)

    def observe(self, state: PlanarState, goal: Goal) -> tuple[Array, ...]:
        """What every controller of this task sees; see `Task.observe`."""
        target = goal.current
        x, y = goal_terms(state, target)
        fine = fine_terms(x, y, saturation=self.fine_distance)
        motion = motion_terms(state)
        terms: tuple[Array, ...] = (x, y, *heading_terms(state, target), *motion, *fine)
        if self.fine_heading_deg:
            error = wrapped(target[..., 2] - state.yaw)
            terms += (clip(error / math.radians(self.fine_heading_deg), -1.0, 1.0),)
        if self.fine_speed:
            terms += tuple(clip(speed / self.fine_speed, -1.0, 1.0) for speed in motion[:2])
        if self.fine_yaw_rate:
            terms += (clip(motion[2] / self.fine_yaw_rate, -1.0, 1.0),)
        return terms

    def reward(self, before: PlanarState, after: PlanarState, goal: Goal, ended: Goal) -> Array:
        """Reward of one control step; see `Task.reward`."""
        old, new = self.errors(before, goal), self.errors(after, goal)
        xp = array_namespace(after.x)
        w = self.reward_weights
        d, e = new.position, xp.abs(new.heading)
        return weighted_sum(
            (w.position, lambda: xp.exp(-d / 0.25)),
            (w.heading, lambda: xp.exp(-e / 0.25)),
            (w.far, lambda: xp.exp(-d / 2.0)),
            (w.joint, lambda: xp.exp(-d / 0.1 - e / 0.15)),
            (w.joint_far, lambda: xp.exp(-d - e)),
            (w.facing, lambda: xp.exp(-d) * 0.5 * (1.0 + xp.cos(e))),
            (w.approach, lambda: old.position - d),
            (w.turn, lambda: xp.abs(old.heading) - e),
            (w.fine, lambda: xp.exp(-d / 0.03 - e / 0.03)),
            (w.turned, lambda: 0.5 * (1.0 - xp.tanh((e - 0.08) / 0.02))),
            (w.aligned, lambda: xp.exp(-e / 0.03)),
            (w.centred, lambda: xp.exp(-d / 0.03)),
            zero=xp.zeros_like(d),
        )

    def errors(self, state: PlanarState, goal: Goal) -> Errors:
        """Distance from the goal, and heading error."""
        return pose_errors(state, goal.current, heading=True)
