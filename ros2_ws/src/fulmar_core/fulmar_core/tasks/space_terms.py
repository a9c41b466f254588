"""Observation terms, errors and starts that tasks in space share."""

from __future__ import annotations

from dataclasses import dataclass

from fulmar_core.states.arrays import array_namespace, clip
from fulmar_core.states.attitude import (
    Vector,
    angle_between,
    conjugate,
    first_rows,
    length,
    minus,
    product,
    rotation_error,
    scaled,
    turn_back,
    uniform_attitude,
    uniform_direction,
)
from fulmar_core.states.counter_rng import Draws
from fulmar_core.states.rotation import Array
from fulmar_core.states.spatial import SpatialState, position_of, quat_of
from fulmar_core.tasks.terms import Errors, Start

AXES = ("x", "y", "z")
POSITION_TERMS = tuple(f"goal_{axis}_in_body" for axis in AXES)
FINE_TERMS = (*(f"fine_goal_{axis}_in_body" for axis in AXES), "goal_distance")
ATTITUDE_TERMS = tuple(f"attitude_error_{axis}" for axis in AXES)
FINE_ATTITUDE_TERMS = tuple(f"fine_attitude_error_{axis}" for axis in AXES)
ROTATION_TERMS = tuple(f"rotation_to_goal_{row}{column}" for row in (1, 2) for column in (1, 2, 3))
MOTION_TERMS = (*(f"velocity_{axis}_in_body" for axis in AXES), *(f"turn_rate_{axis}" for axis in AXES))


@dataclass(frozen=True)
class SpaceStart(Start):
    """Where episodes begin, relative to the goal: directions and attitudes are uniform over the sphere and over SO(3).

    Of kinds that cannot hold every attitude, over those that they can.

    RANS draws the polar angle uniformly, which crowds starts at the poles (thesis §3.3.6).
    """

    def draw_in_space(
        self, draws: Draws, *, training: bool, tilt_deg: float = 180.0
    ) -> tuple[SpatialState, Array]:
        """Draw starts at rest, shapes (worlds,), and goal poses, shape (worlds, 7), that tilt no further [deg]."""
        low, high = self.training_distance if training else self.distance
        place = draws.uniform(-0.5 * self.goal_area, 0.5 * self.goal_area, 3)
        numbers = draws.uniform(0.0, 1.0, 8)
        distance = draws.uniform(low, high)
        goal_quat = uniform_attitude(*(numbers[:, i] for i in range(3)), tilt_deg=tilt_deg)
        quat = uniform_attitude(*(numbers[:, i] for i in range(3, 6)), tilt_deg=tilt_deg)
        aside = uniform_direction(numbers[:, 6], numbers[:, 7])
        x, y, z = (place[:, i] + distance * aside[i] for i in range(3))
        xp = array_namespace(place)
        goal = xp.concat((place, xp.stack(goal_quat, axis=-1)), axis=-1)
        return SpatialState.at_rest((x, y, z), quat), goal


def place_errors(state: SpatialState, target: Array, *, attitude: bool) -> Errors:
    """Distance from a pose (..., 7), and the angle of the rotation to it."""
    away = state.distance_to(target)
    return Errors(away, attitude=angle_between(state.quat, quat_of(target)) if attitude else None)


def goal_terms(state: SpatialState, target: Array) -> Vector:
    """Vector to a target in the body's frame, `POSITION_TERMS` [m]."""
    return turn_back(state.quat, minus(position_of(target), state.position))


def fine_terms(way: Vector, *, saturation: float) -> tuple[Array, Array, Array, Array]:
    """Vector to the goal magnified near it, cut to length 1, and the distance [m], `FINE_TERMS`."""
    distance = length(way)
    return (*scaled(1.0 / clip(distance, saturation, None), way), distance)


def attitude_terms(state: SpatialState, target: Array) -> Vector:
    """Rotation vector to the target's attitude in the body's frame, `ATTITUDE_TERMS` [rad]."""
    return rotation_error(state.quat, quat_of(target))


def fine_attitude_terms(error: Vector, *, saturation: float) -> Vector:
    """The same magnified near zero, cut to length 1, `FINE_ATTITUDE_TERMS`."""
    return scaled(1.0 / clip(length(error), saturation, None), error)


def rotation_terms(state: SpatialState, target: Array) -> tuple[Array, ...]:
    """Two rows of the rotation matrix to the target's attitude, without jumps, `ROTATION_TERMS`."""
    return first_rows(product(conjugate(state.quat), quat_of(target)))


def motion_terms(state: SpatialState) -> tuple[Array, ...]:
    """Velocity and turn rate in the body's frame, `MOTION_TERMS`."""
    return (*state.velocity_in_body, *state.rate)
