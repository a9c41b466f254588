"""Follow a pose that moves in space: what tasks share whose target is known beforehand, as poses apart in time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from fulmar_core.states.arrays import array_namespace, clip
from fulmar_core.states.attitude import (
    length,
    scaled,
    turn_back,
)
from fulmar_core.states.rotation import Array
from fulmar_core.states.spatial import SpatialState
from fulmar_core.tasks.goal import Goal, no_obstacles
from fulmar_core.tasks.goal_words import number
from fulmar_core.tasks.pose_reference import Reference, between, motion_errors, vector_of
from fulmar_core.tasks.references.planned_flight import of_one_sign
from fulmar_core.tasks.space_terms import (
    ATTITUDE_TERMS,
    AXES,
    FINE_ATTITUDE_TERMS,
    FINE_TERMS,
    MOTION_TERMS,
    POSITION_TERMS,
    ROTATION_TERMS,
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

# Among the things of a goal, seven numbers each. Pose now: place [m], quaternion x, y, z, w.
NOW = "reference"
MOTION = "reference_motion"  # velocity [m/s], turn rate about the target's own axes [rad/s], time [s]
CHANGE = "reference_change"  # of the motion [m/s², rad/s²], and 0
ERROR_TERMS = (
    *(f"velocity_error_{axis}_in_body" for axis in AXES),
    *(f"turn_rate_error_{axis}" for axis in AXES),
)
CHANGE_TERMS = tuple(f"target_acceleration_{axis}_in_body" for axis in AXES)
ACCELERATION = 0.05  # that counts as 1 in the observation [m/s²]


@dataclass(frozen=True)
class FollowReward:
    """Weights of the reward, per control step; d is the distance, e the angle to the target's attitude."""

    near: float  # times exp(-d / 0.25 m)
    far: float  # times exp(-d / 2 m): leads in from metres away
    attitude: float  # times exp(-e / 0.25 rad)
    facing: float  # times (1 + cos e) / 2: no plateau far from the attitude
    joint: float  # times exp(-d / 0.1 m - e / 0.15 rad): asks for both at once
    approach: float  # times metres come nearer
    turn: float  # times radians come nearer
    velocity: (
        float  # times exp(-v / 0.05 m/s) with v the error of the velocity, where d is small: exp(-d / 0.5 m)
    )


@dataclass(frozen=True, kw_only=True)
class MovingPose(FileTask[SpatialState]):
    """Stay with poses that lie `spacing_s` apart in time, all of them known from the start (`goal_path`).

    Between them it is where `pose_reference.between` puts it.
    """

    spacing_s: float  # between two poses [s]
    fine_distance: float  # where the magnified position saturates [m]
    fine_angle: float  # where the magnified attitude error saturates [rad]
    reward_weights: FollowReward

    goal_topic: ClassVar[str] = "goal_path"
    moves: bool = True
    state_type = SpatialState
    observation_names: ClassVar[tuple[str, ...]] = (
        *POSITION_TERMS,
        *FINE_TERMS,
        *ATTITUDE_TERMS,
        *FINE_ATTITUDE_TERMS,
        *MOTION_TERMS,
        *ROTATION_TERMS,
        *ERROR_TERMS,
        *CHANGE_TERMS,
    )

    def __post_init__(self) -> None:
        if min(self.spacing_s, self.fine_distance, self.fine_angle) <= 0.0:
            raise ValueError("spacing_s, fine_distance and fine_angle must be greater than 0.")

    def said(self, goal: Goal) -> str:
        """See `Task.said`."""
        return f"a path of {number(self.spacing_s * (len(goal.targets) - 1))} s ({self.title})"

    def goal_through(self, poses: Array, done: Array) -> Goal:
        """The goal of many worlds at its first pose; poses of shape (worlds, k, 7), `done` zeros of (worlds,)."""
        xp = array_namespace(poses)
        return self.begun(
            Goal(xp.asarray(of_one_sign(np.asarray(poses))), done, no_obstacles(len(done))), None
        )

    def begun(self, goal: Goal, state: SpatialState | None) -> Goal:
        """The target at its first pose; see `Task.begun`."""
        if isinstance(goal.targets, np.ndarray):
            goal = replace(goal, targets=of_one_sign(goal.targets))
        return self._at(goal, 0.0 * goal.targets[..., 0, 0])

    def advance(self, goal: Goal, state: SpatialState, time_s: Array) -> Goal:
        """The target moves on; see `Task.advance`."""
        return self._at(goal, time_s + 0.0 * goal.targets[..., 0, 0])

    def _at(self, goal: Goal, time_s: Array) -> Goal:
        """The goal at a time since it began, shape (...,) [s]."""
        targets = goal.targets
        xp, last = array_namespace(targets), targets.shape[-2] - 1
        share = clip(time_s / self.spacing_s, 0.0, float(last))
        before = clip(xp.floor(share + 1e-6), 0.0, max(last - 1.0, 0.0))
        going = xp.astype(time_s < last * self.spacing_s - 1e-6, targets.dtype)[..., None]
        now = between(targets, before, (share - before)[..., None], self.spacing_s)
        zero = 0.0 * now.pose[..., :1]
        things = {
            NOW: now.pose,
            MOTION: xp.concat((going * now.motion, time_s[..., None] + zero), axis=-1),
            CHANGE: xp.concat((going * now.change, zero), axis=-1),
        }
        return replace(goal, done=xp.astype(before, goal.done.dtype), things={**goal.things, **things})

    def reference_of(self, goal: Goal) -> Reference:
        """The target now; of a goal that has not begun, its first pose at rest."""
        if NOW in goal.things:
            return Reference(goal.things[NOW], goal.things[MOTION][..., :6], goal.things[CHANGE][..., :6])
        first = goal.targets[..., 0, :]
        return Reference(first, 0.0 * first[..., :6], 0.0 * first[..., :6])

    def target_of(self, goal: Goal) -> Array:
        """See `Task.target_of`."""
        return self.reference_of(goal).pose

    def distance_from_goal(self, state: SpatialState, goal: Goal) -> Array | None:
        """See `Task.distance_from_goal`."""
        return state.distance_to(self.target_of(goal))

    def observe(self, state: SpatialState, goal: Goal) -> tuple[Array, ...]:
        """What every controller of this task sees; see `Task.observe`."""
        now = self.reference_of(goal)
        way, error = goal_terms(state, now.pose), attitude_terms(state, now.pose)
        velocity, rate = motion_errors(state, now)
        push = turn_back(state.quat, vector_of(now.change))
        return (
            *way,
            *fine_terms(way, saturation=self.fine_distance),
            *error,
            *fine_attitude_terms(error, saturation=self.fine_angle),
            *motion_terms(state),
            *rotation_terms(state, now.pose),
            *velocity,
            *rate,
            *scaled(1.0 / ACCELERATION, push),
        )

    def reward(self, before: SpatialState, after: SpatialState, goal: Goal, ended: Goal) -> Array:
        """Reward of one control step; see `Task.reward`."""
        old, new = self.errors(before, goal), self.errors(after, ended)
        xp, w = array_namespace(after.x), self.reward_weights
        d, e = new.position, new.attitude

        def slip() -> Array:
            return length(motion_errors(after, self.reference_of(ended))[0])

        terms: tuple[tuple[float, Callable[[], Array]], ...] = (
            (w.near, lambda: xp.exp(-d / 0.25)),
            (w.far, lambda: xp.exp(-d / 2.0)),
            (w.attitude, lambda: xp.exp(-e / 0.25)),
            (w.facing, lambda: 0.5 * (1.0 + xp.cos(e))),
            (w.joint, lambda: xp.exp(-d / 0.1 - e / 0.15)),
            (w.approach, lambda: old.position - d),
            (w.turn, lambda: old.attitude - e),
            (w.velocity, lambda: xp.exp(-slip() / 0.05 - d / 0.5)),
        )
        return weighted_sum(*terms, zero=xp.zeros_like(d))

    def errors(self, state: SpatialState, goal: Goal) -> Errors:
        """Distance from the target, and angle to its attitude."""
        return place_errors(state, self.target_of(goal), attitude=True)
