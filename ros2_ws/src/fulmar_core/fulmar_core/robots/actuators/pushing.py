"""Families that push a free body: forces at fixed places, along fixed directions."""

from __future__ import annotations

import functools
from abc import abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from array_api_compat import device

from fulmar_core.robots.actuators.excitation import Excitation
from fulmar_core.robots.actuators.family import Actuators, check_names
from fulmar_core.robots.actuators.parts import Fixture
from fulmar_core.states.arrays import array_namespace, sum_of
from fulmar_core.states.attitude import Vector
from fulmar_core.states.rotation import Array

Vector3 = tuple[float, float, float]
PLANAR = [0, 1, 5]  # of a wrench: force ahead, to the left, and yaw moment
WRENCH = 6  # numbers of a wrench in space: three forces, three torques


@dataclass(frozen=True)
class Push:
    """Where one actuator pushes, in the body frame."""

    name: str
    position: Vector3  # where the force acts [m]
    direction: Vector3  # of the force on the body for a positive command, a unit vector [-]
    couple: float = 0.0  # torque about `direction` that comes with each newton, as of a rotor that spins [m]


@dataclass(frozen=True)
class Mount:
    """Where one actuator sits and pushes, in the body frame, as a robot's file says it."""

    name: str
    position: Vector3  # where the force acts [m]
    direction: Vector3  # of the force on the body, any length > 0 [-]

    WHAT: ClassVar[str]  # in messages

    def __post_init__(self) -> None:
        if np.linalg.norm(self.direction) < 1e-6:
            raise ValueError(f"{self.WHAT} '{self.name}': 'direction' must not be zero.")

    @property
    def push(self) -> Push:
        """The same with a unit vector."""
        return Push(self.name, self.position, _unit(self.direction))


class Pushing(Actuators):
    """A family of which each actuator pushes the body at one place along one line.

    Attributes:
        shared_pressure: Actuators share one supply, so that their shares of the full thrust add up to 1 at most.
    """

    shared_pressure: bool
    excitation = Excitation(hold_s=0.6, foresight_s=2.0)  # commands change with the rhythm of control

    @property
    @abstractmethod
    def pushes(self) -> tuple[Push, ...]:
        """Place and direction of each actuator."""

    @abstractmethod
    def thrusts(self, command: Array) -> Array:
        """Thrust of each actuator along its direction.

        Args:
            command: What each does, shape (..., n).

        Returns:
            Shape (..., n) [N].
        """

    def check_parts(self, key: str) -> None:
        """Refuse what families of all actuators alike refuse, `key` naming their list.

        Raises:
            ValueError: There are none, two have one name, or `response` does not fit them.
        """
        count, one = len(self.names), key.removesuffix("s")
        check_names(key, one, self.names)
        if self.response.slew and len(self.response.slew) != count:
            raise ValueError(f"'slew' needs {count} values, one for each {one}.")
        self.response.refuse_lag_beside_slew()

    @property
    def fixtures(self) -> tuple[Fixture, ...]:
        """Each with its x axis along the force of a positive command; see `Actuators.fixtures`."""
        return tuple(Fixture(push.name, push.position, push.direction) for push in self.pushes)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the actuators, in the order of every command vector."""
        return tuple(push.name for push in self.pushes)

    @property
    def scale(self) -> np.ndarray:
        """Largest command of each, a share of full thrust, shape (n,) [-]."""
        return np.ones(len(self.pushes))

    @functools.cached_property
    def full_thrust(self) -> np.ndarray:
        """Thrust of each actuator at full command, the others at rest, shape (n,) [N]."""
        return np.asarray(self.thrusts(np.diag(self.scale))).diagonal()

    @functools.cached_property
    def wrench_per_newton(self) -> np.ndarray:
        """Force and torque in the body frame of 1 N by each actuator, shape (n, 6) [N, N·m]."""
        positions = np.array([push.position for push in self.pushes])
        directions = np.array([push.direction for push in self.pushes])
        couples = np.array([push.couple for push in self.pushes])[:, None]
        return np.concatenate((directions, np.cross(positions, directions) + couples * directions), axis=1)

    @property
    def full_wrenches(self) -> tuple[np.ndarray, np.ndarray, bool]:
        """Of each actuator; see `Actuators.full_wrenches`."""
        least = np.asarray(self.thrusts(np.diag(self.lowest))).diagonal() / self.full_thrust
        return self.full_thrust[:, None] * self.wrench_per_newton, least, self.shared_pressure

    @property
    def sideways(self) -> bool:
        """Whether any actuator pushes to a side."""
        return bool(np.abs(self.wrench_per_newton[:, 1]).max() > 1e-9)

    def wrench_in_body(self, command: Array) -> tuple[Array, Array]:
        """Total force and torque of a command.

        Args:
            command: What each actuator does, shape (..., n).

        Returns:
            Force (..., 3) [N] and torque about the body's origin (..., 3) [N·m], both in the body frame.
        """
        xp = array_namespace(command)
        matrix = xp.asarray(self.wrench_per_newton, dtype=command.dtype, device=device(command))
        wrench = self.thrusts(command) @ matrix
        return wrench[..., 0:3], wrench[..., 3:6]

    def planar_wrench(self, applied: Array, gain: Array) -> tuple[Array, Array, Array]:
        """Force and moment in the body's plane.

        Args:
            applied: What each actuator does, shape (n, ...).
            gain: Factor on each thrust, same shape.

        Returns:
            Force ahead [N], to the left [N], and yaw moment [N·m], shapes (...,).
        """
        xp = array_namespace(applied)
        thrust = xp.moveaxis(self.thrusts(xp.moveaxis(applied, 0, -1)), -1, 0) * gain
        ahead, left, moment = (
            sum_of([float(weight) * thrust[i] for i, weight in enumerate(self.wrench_per_newton[:, column])])
            for column in PLANAR
        )
        return ahead, left, moment

    def spatial_wrench(self, applied: Array, gain: Array) -> tuple[Vector, Vector]:
        """Force and torque in the body's frame.

        Args:
            applied: What each actuator does, shape (n, ...).
            gain: Factor on each thrust, same shape.

        Returns:
            Force [N] and torque about the body's origin [N·m], each three arrays of shape (...,).
        """
        xp = array_namespace(applied)
        thrust = xp.moveaxis(self.thrusts(xp.moveaxis(applied, 0, -1)), -1, 0) * gain
        x, y, z, roll, pitch, yaw = (
            sum_of([float(weight) * thrust[i] for i, weight in enumerate(column)])
            for column in self.wrench_per_newton.T
        )
        return (x, y, z), (roll, pitch, yaw)

    def by_hand(self, ahead: float, left: float, turn: float) -> np.ndarray | None:
        """None: the wrench that a person asks for is allocated; see `Actuators.by_hand`."""
        return None

    def mirrored(self) -> np.ndarray | None:
        """Each actuator for the one across the x axis, where all have one; see `Actuators.mirrored`."""
        # Left for right turns over forces to the left, and the moments about x and z.
        images = self.full_thrust[:, None] * self.wrench_per_newton
        across = images * np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])
        same = np.abs(across[:, None] - images).max(axis=-1) < 1e-9 * np.abs(images).max()
        return same.astype(float) if (same.sum(axis=1) == 1).all() else None


class OneWay(Pushing):
    """A family of which each actuator pushes one way, from nothing to its full thrust."""

    one_way = True


def wrench_columns(count: int) -> list[int]:
    """Which of the six numbers of a wrench count where wrenches have so many: 3 of robots in the plane, or all 6.

    Raises:
        ValueError: Any other count.
    """
    if count not in (len(PLANAR), WRENCH):
        raise ValueError(
            f"a wrench has {len(PLANAR)} numbers for robots on a floor or on water and {WRENCH} in space, "
            f"found {count}."
        )
    return PLANAR if count == len(PLANAR) else list(range(WRENCH))


def _unit(vector: Vector3) -> Vector3:
    """A vector of length 1 along another one, which is not zero."""
    length = sum(part * part for part in vector) ** 0.5
    return vector[0] / length, vector[1] / length, vector[2] / length
