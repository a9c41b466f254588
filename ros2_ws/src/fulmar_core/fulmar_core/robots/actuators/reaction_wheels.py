"""Reaction wheels: torque by motors that speed flywheels up, with limits, friction and momentum.

Conventions: a command is the torque of each motor on its wheel about the wheel's axis, as the effort of a joint in
ROS; the body gets the opposite torque. The speed of a wheel is relative to the body. The body's inertia tensor in a
robot's file is that of the whole spacecraft with its wheels locked, with their spin inertia.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from array_api_compat import device

from fulmar_core.config.plausible_ranges import Plausible
from fulmar_core.robots.actuators.excitation import Excitation
from fulmar_core.robots.actuators.family import Actuators, check_names
from fulmar_core.robots.actuators.parts import Fixture
from fulmar_core.robots.actuators.response import Response
from fulmar_core.states.arrays import array_namespace, clip, sum_of
from fulmar_core.states.attitude import Vector
from fulmar_core.states.rotation import Array

Vector3 = tuple[float, float, float]
AXES = "xyz"
SLOW = 0.5  # speed above which friction has its full Coulomb part: smooth, so that integrators do not chatter [rad/s]


@dataclass(frozen=True)
class Wheel:
    """One wheel, in the body frame."""

    name: str
    axis: Vector3  # about which it spins, of any length > 0 [-]

    def __post_init__(self) -> None:
        if np.linalg.norm(self.axis) < 1e-6:
            raise ValueError(f"wheel '{self.name}': 'axis' must not be zero.")

    @property
    def direction(self) -> np.ndarray:
        """Unit vector of the axis, shape (3,)."""
        return np.array(self.axis) / float(np.linalg.norm(self.axis))


def _least_inertia(robot: Any) -> float:
    """Of the body, with its wheels [kg·m²]."""
    return float(min(robot.body.inertia[:3]))


@dataclass(frozen=True)
class Unloading:
    """A torque from outside of the body that takes momentum out of the wheels."""

    kind: Literal["thrusters", "magnetic"]  # magnetic: none along the field, which turns along the orbit
    torque: float  # largest, about each body axis [N·m]

    def __post_init__(self) -> None:
        if self.torque <= 0.0:
            raise ValueError("'unloading.torque' must be greater than 0; without unloading leave it out.")


@dataclass(frozen=True)
class ReactionWheels(Actuators):
    """A command has the motor torque of each wheel, and after them the unloading torques about x, y and z [N·m].

    At its top speed a wheel takes only torque that slows it down. The friction of its bearing, `coulomb` + `viscous` ·
    speed, acts against its motion relative to the body.
    """

    kind: Literal["reaction_wheels"]
    torque: float  # largest of each motor [N·m]
    spin_inertia: float  # of each wheel about its axis [kg·m²]
    top_speed: float  # of each wheel relative to the body [rad/s]
    wheels: tuple[Wheel, ...]
    viscous: float = 0.0  # friction per speed [N·m·s/rad]
    coulomb: float = 0.0  # friction that does not depend on the speed [N·m]
    unloading: Unloading | None = None
    response: Response = Response()

    turns_only = True
    excitation = Excitation(hold_s=20.0, foresight_s=0.0, calm=1.0)
    plausible = (
        Plausible(
            "actuators.torque", "N·m", (1e-6, 5.0), (1e-4, 1.0), "of the body's smallest inertia: up to 1 rad/s²",
            scale=_least_inertia,
        ),
        Plausible(
            "actuators.spin_inertia", "kg·m²", (1e-7, 0.1), (1e-5, 0.02), "of the body's smallest, with its wheels",
            scale=_least_inertia,
        ),
        Plausible(
            "actuators.response.slew.*", "N·m/s", (0.01, 1e5), (0.1, 1e4), "of the motors' torque in a second",
            scale=lambda robot: robot.actuators.torque,
        ),
        Plausible("actuators.top_speed", "rad/s", (50.0, 2500.0), (80.0, 2000.0), "500 to 20,000 rpm"),
        Plausible(
            "actuators.unloading.torque", "N·m", (1e-5, 20.0), (1e-3, 2.0), "of a wheel's: torque rods to thrusters",
            scale=lambda robot: robot.actuators.torque,
        ),
    )  # fmt: skip

    def __post_init__(self) -> None:
        check_names("wheels", "wheel", self.wheel_names)
        check_names("wheels", "wheel", self.names)  # an unloading torque has a name, too
        if min(self.torque, self.spin_inertia, self.top_speed) <= 0.0:
            raise ValueError("torque, spin_inertia and top_speed must be greater than 0.")
        if min(self.viscous, self.coulomb) < 0.0:
            raise ValueError("viscous and coulomb must not be negative.")
        friction = self.coulomb + self.viscous * self.top_speed
        if friction >= self.torque:
            raise ValueError(
                f"'coulomb' + 'viscous' · 'top_speed' = {friction:g} N·m must be below 'torque' = {self.torque:g} N·m: "
                "with such a bearing no motor brings a wheel to its top speed."
            )
        if self.response.slew and len(self.response.slew) != len(self.names):
            raise ValueError(f"'slew' needs {len(self.names)} values, one for each actuator.")
        self.response.refuse_lag_beside_slew()

    def check_carried(self, inertia: Sequence[float], *, any_moments: bool) -> None:
        """Refuse a body of which nothing is left without its wheels, as simulators have it.

        Args:
            inertia: Of the body with its wheels, shape (3,) [kg·m²].
            any_moments: The body's moments are none of a body, and stay; see `Body.as_printed`.

        Raises:
            ValueError: The wheels are too heavy.
        """
        most = min(inertia) if any_moments else min(*inertia, sum(inertia) - 2.0 * max(inertia))
        if self.count * self.spin_inertia >= most:
            raise ValueError(
                f"'actuators.spin_inertia' = {self.spin_inertia:g} kg·m² of each of {self.count} wheels is no part of "
                f"'body.inertia' = {list(inertia)} kg·m², which is that of the whole: it must be below "
                f"{most / self.count:.4g} kg·m²."
            )

    @property
    def fixtures(self) -> tuple[Fixture, ...]:
        """Each wheel in the body's middle, its x axis along its own; see `Actuators.fixtures`."""
        return tuple(Fixture(wheel.name, (0.0, 0.0, 0.0), wheel.direction.tolist()) for wheel in self.wheels)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the wheels, and of the unloading torques about the body's axes where there is unloading."""
        outside = tuple(f"unload_{axis}" for axis in AXES) if self.unloading is not None else ()
        return (*self.wheel_names, *outside)

    @property
    def units(self) -> tuple[str, ...]:
        """Torques; see `Actuators.units`."""
        return ("N·m",) * len(self.names)

    @property
    def wheel_names(self) -> tuple[str, ...]:
        """Names of the wheels."""
        return tuple(wheel.name for wheel in self.wheels)

    @property
    def count(self) -> int:
        """Number of wheels."""
        return len(self.wheels)

    @functools.cached_property
    def axes(self) -> np.ndarray:
        """Unit vectors of the wheels' axes in the body frame, shape (count, 3)."""
        return np.array([wheel.direction for wheel in self.wheels])

    @functools.cached_property
    def scale(self) -> np.ndarray:
        """Largest torque of each actuator, shape (n,) [N·m]."""
        outside = [self.unloading.torque] * 3 if self.unloading is not None else []
        return np.array([self.torque] * self.count + outside)

    @functools.cached_property
    def torque_per_command(self) -> np.ndarray:
        """Torque on the body per unit of each command, its wheels slow, shape (n, 3) [-]."""
        outside = np.eye(3) if self.unloading is not None else np.zeros((0, 3))
        return np.concatenate((-self.axes, outside))

    @property
    def full_wrenches(self) -> tuple[np.ndarray, np.ndarray, bool]:
        """Of each wheel: unloading comes from outside, and is weak; see `Actuators.full_wrenches`."""
        torques = self.scale[: self.count, None] * self.torque_per_command[: self.count]
        return np.concatenate((np.zeros_like(torques), torques), axis=1), -np.ones(self.count), False

    @property
    def top_momentum(self) -> float:
        """Momentum of one wheel at its top speed [N·m·s]."""
        return self.spin_inertia * self.top_speed

    def limited(self, command: Array) -> Array:
        """Nearest command that the hardware can carry out, shape (..., n)."""
        xp = array_namespace(command)
        most = xp.asarray(self.scale, dtype=command.dtype, device=device(command))
        return clip(command, -most, most)

    def motor_torque(self, wanted: Array, speed: Array, dt: float) -> Array:
        """Torque of each motor, cut so that no wheel exceeds its top speed.

        Args:
            wanted: Shape (count, ...) [N·m].
            speed: Of the wheels relative to the body, same shape [rad/s].
            dt: Time for which it is held, > 0 [s].

        Returns:
            Same shape [N·m].
        """
        xp, gain = array_namespace(wanted), self.spin_inertia / dt
        zero = xp.zeros_like(speed)
        most = xp.maximum(gain * (self.top_speed - speed), zero)
        least = xp.minimum(gain * (-self.top_speed - speed), zero)
        return xp.minimum(xp.maximum(wanted, least), most)

    def friction_torque(self, speed: Array) -> Array:
        """Torque of the bearings on each wheel, against its motion [N·m]; `speed` as in `motor_torque`."""
        return -self.viscous * speed - self.coulomb * array_namespace(speed).tanh(speed / SLOW)

    @property
    def has_friction(self) -> bool:
        """Whether a wheel left alone slows down."""
        return bool(self.viscous or self.coulomb)

    def unloading_torque(self, applied: Array, field: Vector | None) -> Vector | None:
        """Torque from outside about the body's axes [N·m]; None without unloading.

        Args:
            applied: What each actuator does, shape (n, ...).
            field: Unit vector of the magnetic field in the body frame; None for thrusters.
        """
        if self.unloading is None:
            return None
        torque = applied[self.count], applied[self.count + 1], applied[self.count + 2]
        if field is None:
            return torque
        along = sum_of([part * other for part, other in zip(torque, field, strict=True)])
        x, y, z = (part - along * other for part, other in zip(torque, field, strict=True))
        return x, y, z

    def to_body(self, per_wheel: Any) -> np.ndarray:
        """Vectors in the body frame that scalars along the wheels' axes make, shape (..., count) to (..., 3)."""
        return np.asarray(np.asarray(per_wheel) @ self.axes)
