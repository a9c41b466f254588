"""Steered front wheels and driven wheels, as cars have them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from array_api_compat import device

from fulmar_core.config.plausible_ranges import Plausible
from fulmar_core.robots.actuators.response import Response
from fulmar_core.robots.actuators.rolling import Rolling
from fulmar_core.states.arrays import array_namespace, clip
from fulmar_core.states.gravity import GRAVITY
from fulmar_core.states.planar import PlanarState
from fulmar_core.states.rotation import Array

GRIP = 0.6  # of what friction gives, in curves; the rest is for the motors, which push along the way; our value [-]


@dataclass(frozen=True)
class Ackermann(Rolling):
    """A command is (speed ahead [m/s], steering angle of the middle front wheel [rad]), left positive.

    The body's origin is above the middle of the rear axle.
    """

    kind: Literal["ackermann"]
    wheel_radius: float  # [m]
    track: float  # between left and right wheels [m]
    wheelbase: float  # between the axles [m]
    max_speed: float  # ahead and astern [m/s]
    max_steering: float  # [rad], below a quarter turn
    wheel_force: float  # the most that all wheels push together [N]
    friction: float  # of the tyres on the floor [-]
    response: Response = Response()

    plausible = (
        *Rolling.plausible,
        Plausible(
            "performance.torque", "N·m", (0.005, 1.0), (0.02, 0.6), "of friction · weight · wheelbase",
            scale=lambda robot: robot.actuators.friction * robot.body.mass * GRAVITY * robot.actuators.wheelbase,
        ),
    )  # fmt: skip

    def __post_init__(self) -> None:
        positive = (
            self.wheel_radius, self.track, self.wheelbase, self.max_speed,
            self.max_steering, self.wheel_force, self.friction,
        )  # fmt: skip
        if min(positive) <= 0.0:
            raise ValueError("sizes, speed, force, friction and steering must be greater than 0.")
        if self.max_steering >= 0.5 * np.pi:
            raise ValueError(
                f"'max_steering' = {self.max_steering:g} rad must be below 1.57 rad, a quarter turn. Usual is 0.1 to "
                f"1.2 rad; {self.max_steering:g}° are {math.radians(self.max_steering):.4g} rad."
            )
        if self.response.slew and len(self.response.slew) != 2:
            raise ValueError("'slew' needs two values: of the speed and of the steering angle.")

    @property
    def units(self) -> tuple[str, ...]:
        """Of the two commands; see `Actuators.units`."""
        return ("m/s", "rad")

    @property
    def names(self) -> tuple[str, ...]:
        """Names of a command's entries."""
        return "speed", "steering_angle"

    @property
    def wheels(self) -> dict[str, tuple[float, float]]:
        """See `Rolling.wheels`."""
        half = 0.5 * self.track
        return {
            "rear_left": (0.0, half),
            "rear_right": (0.0, -half),
            "front_left": (self.wheelbase, half),
            "front_right": (self.wheelbase, -half),
        }

    @property
    def scale(self) -> np.ndarray:
        """Largest command [m/s, rad]."""
        return np.array([self.max_speed, self.max_steering])

    def limited(self, command: Array) -> Array:
        """Nearest command that the car can carry out, shape (..., 2).

        The faster it goes, the less it steers, so that its tyres do not slide: v² tan(angle) / wheelbase, what a curve
        asks of them, stays below a share of their friction.
        """
        xp = array_namespace(command)
        most = xp.asarray(self.scale, dtype=command.dtype, device=device(command))
        within = clip(command, -most, most)
        speed, steering = within[..., 0], within[..., 1]
        grip = GRIP * self.friction * GRAVITY * self.wheelbase
        widest = xp.atan(grip / clip(speed * speed, 1e-6, None))
        both = xp.stack((speed, clip(steering, -widest, widest)))
        return both.T if both.ndim == 2 else xp.moveaxis(both, 0, -1)  # worlds side by side in memory

    @property
    def largest_curvature(self) -> float | None:
        """See `Actuators.largest_curvature` [1/m]."""
        return math.tan(self.max_steering) / self.wheelbase

    @property
    def pull(self) -> float:
        """The most that all wheels push together [N]."""
        return self.wheel_force

    def turn_rate(self, speed: float, turn: float) -> float:
        """See `Rolling.turn_rate` [rad/s]."""
        return speed * math.tan(turn) / self.wheelbase

    def next_yaw_rate(
        self, state: PlanarState, speed: Array, turn: Array, twist: Array, yaw_inertia: Array, dt: float
    ) -> Array:
        """Bicycle model with the rear axle as reference; see `Rolling.next_yaw_rate`.

        Source: Rajamani, "Vehicle Dynamics and Control", 2012, §2.2. Tyres push sideways with friction at most; beyond
        it the car goes wider than it steers.
        """
        xp = array_namespace(speed)
        widest = self.friction * GRAVITY / clip(xp.abs(speed), 1e-3, None)
        return clip(speed * xp.tan(turn) / self.wheelbase, -widest, widest)
