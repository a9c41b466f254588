"""Point a satellite: turn to an attitude among the stars, or to one that turns along an orbit, and hold it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import ClassVar, Literal

from fulmar_core.robots.kinds.satellite import SATELLITE
from fulmar_core.robots.robot import Robot
from fulmar_core.states.arrays import array_namespace
from fulmar_core.states.attitude import (
    angle_between,
    exponential,
    length,
    minus,
    product,
    scaled,
    turn_back,
    uniform_attitude,
    uniform_direction,
)
from fulmar_core.states.counter_rng import Draws
from fulmar_core.states.rotation import Array
from fulmar_core.states.spatial import SpatialState, quat_of
from fulmar_core.tasks.goal import Goal, goals_at
from fulmar_core.tasks.goal_words import attitude_words
from fulmar_core.tasks.space_terms import (
    ATTITUDE_TERMS,
    FINE_ATTITUDE_TERMS,
    MOTION_TERMS,
    ROTATION_TERMS,
    attitude_terms,
    fine_attitude_terms,
    rotation_terms,
)
from fulmar_core.tasks.task import FileTask
from fulmar_core.tasks.terms import Errors, weighted_sum

FIRST = "first_target"  # among the things of a goal: the target when its time began


@dataclass(frozen=True)
class PointStart:
    """How episodes begin: the body turned away from the target about any axis, and moving with it."""

    angle_deg: tuple[float, float]  # between body and target [deg]
    training_angle_deg: tuple[float, float]  # same, in training [deg]

    def __post_init__(self) -> None:
        for low, high in (self.angle_deg, self.training_angle_deg):
            if not 0.0 <= low <= high <= 180.0:
                raise ValueError(
                    f"angles must be [low, high] with 0 <= low <= high <= 180, found [{low}, {high}]."
                )


@dataclass(frozen=True)
class PointReward:
    """Weights of the reward, per control step; e is the angle to the goal's attitude."""

    attitude: float  # times exp(-e / 0.1 rad)
    facing: float  # times (1 + cos e) / 2: no plateau far from the attitude
    fine: float  # times exp(-e / 0.005 rad)
    turn: float  # times radians come nearer


@dataclass(frozen=True)
class Point(FileTask[SpatialState]):
    """Hold the attitude of a goal on `goal_pose`, whose place does not count.

    With an orbit rate the wanted attitude turns about the world's y from the moment when the goal arrives, as the way
    to the planet does (`worlds.spatial_world.zenith`): what points to the nadir then goes on pointing there.
    """

    kind: Literal["point"]
    start: PointStart
    fine_angle: float  # where the magnified attitude error saturates [rad]
    reward_weights: PointReward
    orbit_rate: float = (
        0.0  # of the wanted attitude about the world's y; 0: it is fixed among the stars [rad/s]
    )

    goal_topic: ClassVar[str] = "goal_pose"
    state_type = SpatialState
    kinds = (SATELLITE,)
    observation_names: ClassVar[tuple[str, ...]] = (
        *ATTITUDE_TERMS,
        *FINE_ATTITUDE_TERMS,
        *MOTION_TERMS[3:],
        *ROTATION_TERMS,
    )

    def said(self, goal: Goal) -> str:
        """See `Task.said`."""
        words = attitude_words(self.state_type, self.state_type.written(goal.current))
        return f"{words}, turning along an orbit" if self.orbit_rate else words

    def farthest_start(self, *, training: bool) -> tuple[str, float]:
        """Nothing limits a distance; see `Task.farthest_start`."""
        return "", 0.0

    def draw(self, draws: Draws, robot: Robot, *, training: bool) -> tuple[SpatialState, Goal]:
        """Draw starts and goals; see `Task.draw`."""
        low, high = self.start.training_angle_deg if training else self.start.angle_deg
        numbers = draws.uniform(0.0, 1.0, 5)
        angle = math.radians(low) + math.radians(high - low) * draws.uniform(0.0, 1.0)
        xp = array_namespace(angle)
        goal = uniform_attitude(*(numbers[:, i] for i in range(3)))
        away = exponential(scaled(angle, uniform_direction(numbers[:, 3], numbers[:, 4])))
        zero = xp.zeros_like(angle)
        state = SpatialState.at_rest((zero, zero, zero), product(goal, away))
        return state, self._begun(goals_at(xp.stack((zero, zero, zero, *goal), axis=-1)))

    def _begun(self, goal: Goal) -> Goal:
        return replace(goal, things={**goal.things, FIRST: goal.targets[..., 0, :]})

    def begun(self, goal: Goal, state: SpatialState) -> Goal:
        """Remember the attitude that the goal began with; see `Task.begun`."""
        return self._begun(goal)

    def advance(self, goal: Goal, state: SpatialState, time_s: Array) -> Goal:
        """The wanted attitude turns along the orbit; see `Task.advance`."""
        if not self.orbit_rate:
            return goal
        first = goal.things[FIRST]
        xp, zero = array_namespace(first), 0.0 * first[..., 0]
        turned = product(exponential((zero, self.orbit_rate * time_s + zero, zero)), quat_of(first))
        target = xp.stack((first[..., 0], first[..., 1], first[..., 2], *turned), axis=-1)
        return replace(goal, targets=target[..., None, :])

    def distance_from_goal(self, state: SpatialState, goal: Goal) -> Array | None:
        """None: the place does not count."""
        return None

    def observe(self, state: SpatialState, goal: Goal) -> tuple[Array, ...]:
        """What every controller of this task sees; see `Task.observe`."""
        error = attitude_terms(state, goal.current)
        fine = fine_attitude_terms(error, saturation=self.fine_angle)
        return (*error, *fine, *state.rate, *rotation_terms(state, goal.current))

    def reward(self, before: SpatialState, after: SpatialState, goal: Goal, ended: Goal) -> Array:
        """Reward of one control step; see `Task.reward`."""
        old, e = self.errors(before, goal).attitude, self.errors(after, goal).attitude
        xp, w = array_namespace(after.x), self.reward_weights
        return weighted_sum(
            (w.attitude, lambda: xp.exp(-e / 0.1)),
            (w.facing, lambda: 0.5 * (1.0 + xp.cos(e))),
            (w.fine, lambda: xp.exp(-e / 0.005)),
            (w.turn, lambda: old - e),
            zero=xp.zeros_like(e),
        )

    def errors(self, state: SpatialState, goal: Goal) -> Errors:
        """Angle to the goal's attitude, and how fast the body turns relative to it."""
        rate = state.rate
        if self.orbit_rate:
            zero = 0.0 * state.wx
            rate = minus(rate, turn_back(state.quat, (zero, zero + self.orbit_rate, zero)))
        return Errors(attitude=angle_between(state.quat, quat_of(goal.current)), rate=length(rate))
