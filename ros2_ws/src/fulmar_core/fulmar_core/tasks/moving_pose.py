"""Follow a pose that moves in space: what tasks share whose target is known beforehand, as poses apart in time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from fulmar_core.states.arrays import array_namespace, clip
from fulmar_core.states.attitude import (
    Quaternion,
    Vector,
    conjugate,
    length,
    minus,
    product,
    scaled,
    turn,
    turn_back,
)
from fulmar_core.states.rotation import Array
from fulmar_core.states.spatial import SpatialState, quat_of
from fulmar_core.tasks.goal import Goal, no_obstacles
from fulmar_core.tasks.goal_words import number
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
class Reference:
    """A target at one moment: pose (..., 7), motion and its change (..., 6), as `NOW`, `MOTION` and `CHANGE`."""

    pose: Array
    motion: Array
    change: Array


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

    Between them place and quaternion are cubic in time with the slopes of their neighbours (Catmull and Rom 1974).
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
        now = self._between(targets, before, (share - before)[..., None], last)
        zero = 0.0 * now.pose[..., :1]
        things = {
            NOW: now.pose,
            MOTION: xp.concat((going * now.motion, time_s[..., None] + zero), axis=-1),
            CHANGE: xp.concat((going * now.change, zero), axis=-1),
        }
        return replace(goal, done=xp.astype(before, goal.done.dtype), things={**goal.things, **things})

    def _between(self, targets: Array, before: Array, part: Array, last: int) -> Reference:
        """The target a part of the way from one of its poses to the next."""
        xp, step = array_namespace(targets), self.spacing_s

        def pose(further: int) -> Array:
            which = xp.astype(clip(before + further, 0.0, float(last)), xp.int64)
            return xp.take_along_axis(targets, which[..., None, None], axis=-2)[..., 0, :]

        a, b, c, d = (pose(further) for further in (-1, 0, 1, 2))
        if last > 1:  # beyond the ends it goes on with the acceleration that it has there
            a = xp.where(before[..., None] < 0.5, 3.0 * (b - c) + d, a)
            d = xp.where(before[..., None] > last - 1.5, 3.0 * (c - b) + a, d)
        first, second, third = c - a, 2.0 * a - 5.0 * b + 4.0 * c - d, 3.0 * (b - c) + d - a
        here = b + 0.5 * part * (first + part * (second + part * third))
        rate = 0.5 * (first + part * (2.0 * second + 3.0 * part * third)) / step
        change = (second + 3.0 * part * third) / (step * step)
        size = xp.sqrt(xp.sum(here[..., 3:] ** 2, axis=-1, keepdims=True))
        quat = here[..., 3:] / size
        return Reference(
            xp.concat((here[..., :3], quat), axis=-1),
            xp.concat((rate[..., :3], turning(quat, rate[..., 3:] / size)), axis=-1),
            xp.concat((change[..., :3], turning(quat, change[..., 3:] / size)), axis=-1),
        )

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
        push = turn_back(state.quat, _vector(now.change))
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


def motion_errors(state: SpatialState, now: Reference) -> tuple[Vector, Vector]:
    """Velocity [m/s] and turn rate [rad/s] of the target less those of a body, along the body's axes."""
    to_target = product(conjugate(state.quat), quat_of(now.pose))
    along = turn_back(state.quat, _vector(now.motion))
    about = turn(to_target, _vector(now.motion[..., 3:]))
    return minus(along, state.velocity_in_body), minus(about, state.rate)


def turning(quat: Array, change: Array) -> Array:
    """Twice the vector of q⁻¹ ⊗ its derivative: a turn rate about the body's axes (Solà eq. 200), shape (..., 3).

    Of the second derivative it is the change of that rate, since the product of two first ones has no vector.
    """
    x, y, z, _ = product(conjugate(_quat(quat)), _quat(change))
    return 2.0 * array_namespace(quat).stack((x, y, z), axis=-1)


def _vector(columns: Array) -> Vector:
    return columns[..., 0], columns[..., 1], columns[..., 2]


def _quat(columns: Array) -> Quaternion:
    return columns[..., 0], columns[..., 1], columns[..., 2], columns[..., 3]
