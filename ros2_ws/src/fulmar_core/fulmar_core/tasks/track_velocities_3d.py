"""Move in space with a wanted velocity and turn rate, which change now and then."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, Literal

from fulmar_core.robots.robot import Robot
from fulmar_core.states.arrays import array_namespace, clip
from fulmar_core.states.attitude import Vector, length, minus, scaled, uniform_attitude, uniform_direction
from fulmar_core.states.counter_rng import Draws
from fulmar_core.states.rotation import Array
from fulmar_core.states.spatial import SpatialState
from fulmar_core.tasks.goal import Goal, no_obstacles
from fulmar_core.tasks.space_terms import AXES, MOTION_TERMS, motion_terms
from fulmar_core.tasks.task import FileTask
from fulmar_core.tasks.terms import Errors
from fulmar_core.tasks.track_velocities import VelocityReward, at_time

ERROR_TERMS = (
    *(f"velocity_error_{axis}_in_body" for axis in AXES),
    *(f"turn_rate_error_{axis}" for axis in AXES),
)
FINE_ERROR_TERMS = tuple(f"fine_{name}" for name in ERROR_TERMS)


@dataclass(frozen=True)
class TrackVelocities3d(FileTask[SpatialState]):
    """Track a velocity and a turn rate in the body's frame; the target arrives on `goal_velocity`.

    Directions of targets are uniform over the sphere, speeds up to the robot's, and no turn is faster than its
    acceleration sustains at that speed. `reward_weights` are those of the plane, of lengths.
    """

    kind: Literal["track_velocities_3d"]
    hold_s: float  # time of one target [s]
    fine_velocity: float  # where the magnified velocity error saturates [m/s]
    fine_rate: float  # same for the turn rate [rad/s]
    reward_weights: VelocityReward

    goal_topic: ClassVar[str] = "goal_velocity"
    state_type = SpatialState
    observation_names: ClassVar[tuple[str, ...]] = (*ERROR_TERMS, *MOTION_TERMS, *FINE_ERROR_TERMS)

    @property
    def step_s(self) -> float:
        """Time from a target to the next one in the list [s]."""
        return self.hold_s

    def draw(self, draws: Draws, robot: Robot, *, training: bool) -> tuple[SpatialState, Goal]:
        """Draw a start at rest, and as many targets as the episode has time for."""
        count, can = math.ceil(self.episode_s / self.hold_s), robot.performance
        towards = uniform_direction(draws.uniform(0.0, 1.0, count), draws.uniform(0.0, 1.0, count))
        about = uniform_direction(draws.uniform(0.0, 1.0, count), draws.uniform(0.0, 1.0, count))
        speed, rate = draws.uniform(0.0, can.speed, count), draws.uniform(0.0, can.yaw_rate, count)
        numbers = draws.uniform(0.0, 1.0, 3)
        xp = array_namespace(speed)
        rate = xp.minimum(rate, can.turning_acceleration / clip(speed, 1e-6, None))
        targets = xp.stack((*scaled(speed, towards), *scaled(rate, about)), axis=-1)
        zero = xp.zeros_like(numbers[:, 0])
        quat = uniform_attitude(*(numbers[:, i] for i in range(3)), tilt_deg=robot.kind.tilt_deg)
        return SpatialState.at_rest((zero, zero, zero), quat), Goal(targets, zero, no_obstacles(draws.worlds))

    def _errors(self, state: SpatialState, goal: Goal) -> tuple[Vector, Vector]:
        """Wanted minus true velocity [m/s] and turn rate [rad/s] in the body's frame."""
        target = goal.current
        return (
            minus((target[..., 0], target[..., 1], target[..., 2]), state.velocity_in_body),
            minus((target[..., 3], target[..., 4], target[..., 5]), state.rate),
        )

    def observe(self, state: SpatialState, goal: Goal) -> tuple[Array, ...]:
        """What every controller of this task sees; see `Task.observe`."""
        velocity, rate = self._errors(state, goal)
        fine_velocity = scaled(1.0 / clip(length(velocity), self.fine_velocity, None), velocity)
        fine_rate = scaled(1.0 / clip(length(rate), self.fine_rate, None), rate)
        return (*velocity, *rate, *motion_terms(state), *fine_velocity, *fine_rate)

    def advance(self, goal: Goal, state: SpatialState, time_s: Array) -> Goal:
        """The next target comes when the time of this one is over."""
        return at_time(goal, time_s, self.step_s)

    def reward(self, before: SpatialState, after: SpatialState, goal: Goal, ended: Goal) -> Array:
        """Reward of one control step; see `Task.reward`."""
        xp, w, errors = array_namespace(after.x), self.reward_weights, self.errors(after, goal)
        return w.of(xp, errors.velocity, errors.rate)

    def errors(self, state: SpatialState, goal: Goal) -> Errors:
        """Lengths of the errors of velocity and turn rate."""
        velocity, rate = self._errors(state, goal)
        return Errors(velocity=length(velocity), rate=length(rate))
