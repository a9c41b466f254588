"""Trims and linear models of an aircraft over height, and what depends on them, interpolated between heights."""

from __future__ import annotations

import functools
from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fulmar_core.dynamics.flight_modes import continuous_model
from fulmar_core.dynamics.flight_trim import Trim, find_trim
from fulmar_core.robots.actuators.control_surfaces import ControlSurfaces
from fulmar_core.robots.robot import Robot
from fulmar_core.states.arrays import clip, is_single
from fulmar_core.states.attitude import turn

# Where trims are solved, of the span; from the last one on it is nearly free air [-].
HEIGHTS = (0.12, 0.2, 0.3, 0.5, 0.8, 1.2, 2.0, 3.0)
MOTION = 11  # states of the motion: y and z; rotation vector, velocity and turn rate, three each
PLACE, TURNED, SPEED, RATE = slice(0, 2), slice(2, 5), slice(5, 8), slice(8, 11)


@dataclass(frozen=True)
class FlightModel:
    """x⁺ = A x + B u for departures from level flight over a control step.

    x: place to the left and up in the world [m]; rotation vector in the body [rad]; velocity in the world [m/s]; turn
    rate in the body [rad/s]; deflections [rad], their rates [rad/s], and thrust levels. u: commands.
    """

    trim: Trim
    a: np.ndarray  # (n, n)
    b: np.ndarray  # (n, m)


def flight_model(robot: Robot, trim: Trim, dt: float) -> FlightModel:
    """The model of an aircraft about a trim, servos and motors included; `dt` of a control step [s]."""
    from scipy.linalg import expm

    craft = robot.actuated_by(ControlSurfaces)
    rates, effects = continuous_model(robot, trim)
    # Departures are in the trim's own body frame; here place and velocity are in the world.
    axes = np.stack([turn(trim.state.quat, tuple(np.eye(3)[i])) for i in range(3)], axis=-1)
    to_world = np.eye(12)
    to_world[0:3, 0:3] = to_world[6:9, 6:9] = axes
    rates, effects = to_world @ rates @ to_world.T, to_world @ effects
    rates, effects = rates[1:, 1:], effects[1:]  # nothing depends on how far along x it is
    surfaces, motors, w = craft.positions, len(craft.motors), craft.servo_rate
    count = MOTION + 2 * surfaces + motors
    a, b = np.zeros((count, count)), np.zeros((count, surfaces + motors))
    place = slice(MOTION, MOTION + surfaces)
    moving = slice(MOTION + surfaces, MOTION + 2 * surfaces)
    level = slice(MOTION + 2 * surfaces, count)
    a[:MOTION, :MOTION] = rates
    a[:MOTION, place], a[:MOTION, level] = effects[:, :surfaces], effects[:, surfaces:]
    a[place, moving] = np.eye(surfaces)
    a[moving, place], a[moving, moving] = (
        -(w**2) * np.eye(surfaces),
        -2.0 * craft.servo_damping * w * np.eye(surfaces),
    )
    b[moving, :surfaces] = w**2 * np.eye(surfaces)
    quick = np.array([1.0 / max(motor.lag_s, 0.2 * dt) for motor in craft.motors])
    a[level, level], b[level, surfaces:] = -np.diag(quick), np.diag(quick)
    joint = np.zeros((count + b.shape[1],) * 2)
    joint[:count, :count], joint[:count, count:] = a, b
    stepped = expm(dt * joint)
    return FlightModel(trim, stepped[:count, :count], stepped[:count, count:])


def heights_of(robot: Robot) -> np.ndarray:
    """Heights of the centre of mass where models are made, ascending [m]."""
    span = robot.wings.span
    above = 1.1 * max(0.0, -robot.hull_span[0] - span * HEIGHTS[0] / 1.1)
    return np.asarray(above + span * np.array(HEIGHTS))


@functools.lru_cache(maxsize=16)
def flight_models(robot: Robot, speed: float, dt: float) -> tuple[FlightModel, ...]:
    """The models at `heights_of`, whose arrays cannot be written; kept, as a law is checked before it is made.

    Raises:
        ConfigError: There is no trim at this speed.
    """
    models = tuple(
        flight_model(robot, find_trim(robot, speed, float(height)), dt) for height in heights_of(robot)
    )
    for model in models:
        for array in (model.a, model.b):
            array.setflags(write=False)
    return models


class Schedule:
    """Arrays that are computed at some heights, and interpolated between them."""

    def __init__(
        self,
        robot: Robot,
        speed: float,
        dt: float,
        make: Callable[[FlightModel], np.ndarray],
        models: tuple[FlightModel, ...] = (),
    ) -> None:
        """Solve the trims; arguments as in `flight_model`, and what is computed of each model, all of one shape.

        `models`: those of another schedule of the same robot, speed and step, which are not solved again.

        Raises:
            ConfigError: There is no trim at this speed.
        """
        self.heights = heights_of(robot)
        self.models = models or flight_models(robot, speed, dt)
        self._arrays = np.stack([make(model) for model in self.models])
        self._commands = np.stack([model.trim.command for model in self.models])
        self._quats = np.stack(
            [np.array([float(part) for part in model.trim.state.quat]) for model in self.models]
        )

    def _between(self, values: np.ndarray, height: np.ndarray) -> np.ndarray:
        return between(values, self.heights, height)

    def array(self, height: np.ndarray) -> np.ndarray:
        """What was computed, at heights (n,), shape (n, ...)."""
        return self._between(self._arrays, height)

    def command(self, height: np.ndarray) -> np.ndarray:
        """Commands of the trims at heights, shape (n, m)."""
        return self._between(self._commands, height)

    def quat(self, height: np.ndarray) -> np.ndarray:
        """Attitudes of the trims at heights, shape (n, 4)."""
        found = self._between(self._quats, height)
        return np.asarray(found / np.linalg.norm(found, axis=-1, keepdims=True))


def between(values: np.ndarray, places: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Values at ascending places, at other ones (n,): linear between them, held beyond, shape (n, ...)."""
    if len(places) == 1:
        return np.repeat(values, len(at), axis=0)
    if is_single(at):
        inside_of = clip(at.item(), float(places[0]), float(places[-1]))
        first = min(max(bisect_right(places, inside_of) - 1, 0), len(places) - 2)
        part = float((inside_of - places[first]) / (places[first + 1] - places[first]))
        return np.asarray((1.0 - part) * values[first] + part * values[first + 1])[None]
    inside = np.clip(at, places[0], places[-1])
    low = np.clip(np.searchsorted(places, inside, side="right") - 1, 0, len(places) - 2)
    share = (inside - places[low]) / (places[low + 1] - places[low])
    share = share.reshape(-1, *(1,) * (values.ndim - 1))
    return np.asarray((1.0 - share) * values[low] + share * values[low + 1])
