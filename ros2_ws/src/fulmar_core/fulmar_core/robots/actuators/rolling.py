"""Families on wheels that do not slip sideways; `dynamics/rolling.py` moves them."""

from __future__ import annotations

import dataclasses
import functools
from abc import abstractmethod
from typing import ClassVar

import numpy as np

from fulmar_core.config.plausible_ranges import Plausible
from fulmar_core.robots.actuators.excitation import Excitation
from fulmar_core.robots.actuators.family import Actuators
from fulmar_core.robots.actuators.parts import Fixture
from fulmar_core.robots.actuators.refuge import RampDown, Refuge
from fulmar_core.robots.actuators.response import Response
from fulmar_core.states.gravity import GRAVITY
from fulmar_core.states.planar import PlanarState
from fulmar_core.states.rotation import Array

CLEARANCE = 0.4  # of the chassis above the floor, in wheel radii; our value [-]
WHEEL_WIDTH = 0.6  # of a wheel, in its radii; our value [-]
CASTER_RADIUS = 0.4  # of a ball caster, in wheel radii; our value [-]
SERVO_S = 0.05  # time constant of a wheel's speed servo where the drive names none [s]


class Rolling(Actuators):
    """A command is (speed ahead [m/s], how to turn), by servos of which the dynamics have the lag.

    Attributes:
        track: Between left and right wheels [m].
        wheel_radius: Of every wheel [m].
        wheel_force: The most that wheels push, as the family counts it [N].
        friction: Of the tyres on the floor [-].
    """

    track: float
    wheel_radius: float
    wheel_force: float
    friction: float
    excitation = Excitation(hold_s=1.5, foresight_s=1.0)  # long enough to come up to speed, and to stop
    plausible: ClassVar[tuple[Plausible, ...]] = (
        Plausible(
            "actuators.wheel_radius", "m", (0.02, 1.0), (0.05, 0.8), "of the radius of the robot's outline",
            scale=lambda robot: robot.body.radius,
        ),
        Plausible(
            "actuators.max_speed", "m/s", (0.8, 5.0), (0.95, 2.0), "of performance.top_speed",
            scale=lambda robot: robot.performance.top_speed,
        ),
        Plausible("actuators.response.slew.0", "m/s²", (0.01, 100.0), (0.1, 30.0), "servos of wheels"),
        Plausible("actuators.response.slew.1", "rad/s²", (0.02, 1000.0), (0.2, 60.0), "same; of steering rad/s"),
        Plausible(
            "actuators.wheel_force", "N", (0.001, 1.5), (0.02, 1.0), "of friction · weight, which tyres hold",
            scale=lambda robot: robot.actuators.friction * robot.body.mass * GRAVITY,
        ),
    )  # fmt: skip

    @property
    @abstractmethod
    def pull(self) -> float:
        """The most that all wheels push together [N]."""

    @property
    @abstractmethod
    def wheels(self) -> dict[str, tuple[float, float]]:
        """Name of each wheel, and its place: ahead of the body's origin and to its left, at axle height [m]."""

    @property
    def casters(self) -> dict[str, float]:
        """Name of each ball caster, and its place ahead of the body's origin [m]."""
        return {}

    @property
    def fixtures(self) -> tuple[Fixture, ...]:
        """Wheels, and casters, which stand on the same floor; see `Actuators.fixtures`."""
        radius = self.wheel_radius
        wheel, ball = (radius, WHEEL_WIDTH * radius), CASTER_RADIUS * radius
        sunk = (CASTER_RADIUS - 1.0) * radius
        return (
            *(Fixture(name, (x, y, 0.0), wheel=wheel) for name, (x, y) in self.wheels.items()),
            *(Fixture(name, (x, 0.0, sunk), wheel=(ball,)) for name, x in self.casters.items()),
        )

    @abstractmethod
    def next_yaw_rate(
        self, state: PlanarState, speed: Array, turn: Array, twist: Array, yaw_inertia: Array, dt: float
    ) -> Array:
        """Turn rate after one integration step, shape (...,) [rad/s].

        Args:
            state: Before it.
            speed: Ahead, after it [m/s].
            turn: Second value of what the servos are asked for.
            twist: Moment from outside [N·m].
            yaw_inertia: Of the robot [kg·m²].
            dt: Integration step, > 0 [s].
        """

    def turn_rate(self, speed: float, turn: float) -> float:
        """Of a command [rad/s]."""
        return turn

    @property
    def own_response(self) -> Response:
        """Without the lag, which the wheels' own servos bring in; see `Actuators.own_response`."""
        return dataclasses.replace(self.response, lag_s=0.0)

    def hull_span(self, height: float) -> tuple[float, float]:
        """The body's origin lies at the height of the axles; see `Actuators.hull_span`."""
        return (CLEARANCE - 1.0) * self.wheel_radius, height - self.wheel_radius

    @property
    def full_wrenches(self) -> tuple[np.ndarray, np.ndarray, bool]:
        """All wheels push ahead together; see `Actuators.full_wrenches`."""
        return np.array([[self.pull, 0.0, 0.0, 0.0, 0.0, 0.0]]), -np.ones(1), False

    @property
    def servo_s(self) -> float:
        """Time constant of the wheels' speed servos [s]."""
        return max(self.response.lag_s, SERVO_S)

    @functools.cached_property
    def refuge(self) -> Refuge:
        """Slow down, so that wheels do not lock; see `Actuators.refuge`."""
        slew = self.response.slew
        return RampDown(self.scale, slew) if slew else super().refuge

    def by_hand(self, ahead: float, left: float, turn: float) -> np.ndarray | None:
        """Speed and turn; see `Actuators.by_hand`."""
        return np.asarray(self.limited(np.array([ahead, turn]) * self.scale))

    def mirrored(self) -> np.ndarray | None:
        """The same speed, and the turn to the other side; see `Actuators.mirrored`."""
        return np.diag([1.0, -1.0])
