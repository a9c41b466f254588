"""Openings for a wrench that is asked for in shares of what a body can do: one rule for every layout of thrusters.

Of the openings that make a wrench the smallest ones (by the pseudo-inverse) may be negative. A positive vector of
openings that makes no wrench lifts them all to zero and above. The torque comes first: it is cut to what the openings
allow, then the force to what is left, both without changing their directions.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fulmar_core.robots.actuators.pushing import WRENCH, Pushing
from fulmar_core.robots.robot import Robot
from fulmar_core.states.arrays import array_namespace, clip
from fulmar_core.states.rotation import Array

LEAST_OPENING = 0.05  # of a thruster in the vector that makes no wrench, beside the widest [-]
FLAT = 1e-6  # an opening that changes by less than this with the force does not limit it [-]


@dataclass(frozen=True)
class WrenchShares:
    """Allocation of one body, or of one body for each world in front; torques are about its centre of mass."""

    openings_per_wrench: Array  # smallest openings for a wrench, shape (..., n, 6) [1/N, 1/(N·m)]
    resting: Array  # openings that make no wrench, the widest 1, shape (..., n) [-]
    limits: Array  # largest force along, and torque about, each axis alone, shape (..., 6) [N, N·m]

    @classmethod
    def of(cls, effect: np.ndarray) -> WrenchShares:
        """Of bodies that are pushed so.

        Args:
            effect: Wrench of each thruster at full command, the others closed, shape (..., 6, n) [N, N·m].

        Raises:
            ValueError: Some body's thrusters have no such vector, or make no wrench about some axis.
        """
        matrix = np.linalg.pinv(effect)
        together = effect.sum(axis=-1)[..., None]
        resting = 1.0 - (matrix @ together)[..., 0]
        resting = resting / np.max(resting, axis=-1, keepdims=True)
        if not np.min(resting) >= LEAST_OPENING or np.min(np.linalg.svd(effect, compute_uv=False)) <= 0.0:
            raise ValueError("its thrusters do not balance one another, all of them open.")
        axes = np.swapaxes(matrix, -1, -2)  # openings of each axis, shape (..., 6, n)
        shared = resting[..., None, :]
        widest = np.maximum(_widest(axes, shared), _widest(-axes, shared))
        return cls(matrix, resting, 1.0 / widest)

    @classmethod
    def of_robot(cls, robot: Robot) -> WrenchShares:
        """Of a robot.

        Raises:
            ValueError: It has no thrusters or fans that open by degrees and share nothing, or as in `of`.
        """
        actuators = robot.actuated_by(Pushing)
        if not actuators.one_way or actuators.binary or actuators.shared_pressure:
            raise ValueError(
                f"'{robot.name}': its {actuators.kind} must open by degrees and share no pressure line."
            )
        try:
            return cls.of(effect_of(robot))
        except ValueError as error:
            raise ValueError(f"'{robot.name}': {error}") from None

    def openings(self, shares: Array) -> Array:
        """Openings for a wrench.

        Args:
            shares: Of `limits`, each in [-1, 1], shape (..., 6) [-].

        Returns:
            Shape (..., n), each in [0, 1].
        """
        xp = array_namespace(shares)
        each = self.openings_per_wrench * (shares * self.limits)[..., None, :]
        force, torque = xp.sum(each[..., :3], axis=-1), xp.sum(each[..., 3:], axis=-1)
        wide = _reach(torque, self.resting)
        fits = 1.0 / clip(xp.max(wide, axis=-1), 1.0, None)
        taken, more = fits[..., None] * wide, _reach(force, self.resting)
        steep = more > FLAT
        room = xp.where(steep, (1.0 - taken) / xp.where(steep, more, xp.ones_like(more)), xp.ones_like(more))
        left = clip(xp.min(room, axis=-1), 0.0, 1.0)
        opened = fits[..., None] * torque + left[..., None] * force
        lift = clip(xp.max(-opened / self.resting, axis=-1), 0.0, None)
        return clip(opened + lift[..., None] * self.resting, 0.0, 1.0)

    def accelerations(self, mass: Array, moments: Array) -> Array:
        """Largest acceleration along, and turn acceleration about, each axis, shape (..., 6) [m/s², rad/s²].

        Args:
            mass: Shape (...,) [kg].
            moments: Of inertia about the axes, shape (..., 3) [kg·m²].
        """
        xp = array_namespace(moments)
        return xp.concat((self.limits[..., :3] / mass[..., None], self.limits[..., 3:] / moments), axis=-1)


def effect_of(robot: Robot) -> np.ndarray:
    """Wrench of each actuator at full command about the robot's centre of mass, shape (6, n) [N, N·m]."""
    actuators = robot.actuated_by(Pushing)
    wrenches = (actuators.full_thrust[:, None] * actuators.wrench_per_newton).copy()
    wrenches[:, 3:] -= np.cross(robot.body.com, wrenches[:, :3])
    return np.asarray(wrenches.T)


def body_terms(robot: Robot) -> np.ndarray:
    """What a network for many bodies sees of a robot's: its `WrenchShares.accelerations`, shape (6,)."""
    found = WrenchShares.of_robot(robot)
    return np.asarray(found.accelerations(np.asarray(robot.body.mass), np.asarray(robot.body.inertia[:3])))


BODY_TERMS = WRENCH  # how many there are


def _reach(openings: Array, resting: Array) -> Array:
    """How wide each thruster opens where another one is closed, or nothing is added: linear, shape (..., n + n²)."""
    xp = array_namespace(openings)
    between = openings[..., :, None] - openings[..., None, :] * (
        resting[..., :, None] / resting[..., None, :]
    )
    return xp.concat((openings, xp.reshape(between, (*between.shape[:-2], -1))), axis=-1)


def _widest(openings: np.ndarray, resting: np.ndarray) -> np.ndarray:
    """Widest opening, once all are lifted to zero, shape (...,)."""
    return np.asarray(_reach(openings, np.broadcast_to(resting, openings.shape)).max(axis=-1))
