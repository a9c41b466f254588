"""Still water about a hull in MuJoCo: the core's formulas, as an outside force at every step."""

from __future__ import annotations

import numpy as np

from fulmar_core.robots.hydrodynamics import Hydrodynamics
from fulmar_core.states.gravity import GRAVITY
from fulmar_core.states.rotation import cross
from fulmar_core.worlds.world import World


class Water:
    """Buoyancy, righting moments, drag and added mass.

    The surface is at z = 0, where the hull floats at rest at any mass. For one hull or many at once.
    """

    def __init__(self, hydrodynamics: Hydrodynamics, places: np.ndarray, directions: np.ndarray) -> None:
        """Take what the hull is like.

        Args:
            hydrodynamics: Of the hull.
            places: Where the actuators push, in the body's frame, shape (n, 3) [m].
            directions: Unit vectors of their forces, shape (n, 3).
        """
        self._water, self._places, self._directions = hydrodynamics, places, directions
        self._mass, self._inertia, self._drag = np.ones(1), np.ones(3), 1.0
        self._offset, self._per_newton = np.zeros(3), np.zeros((len(places), 6))

    def take_world(self, world: World, inertia: np.ndarray) -> None:
        """Take the body of an episode.

        Args:
            world: Mass, centre of mass and the factor on the drag, without a batch axis.
            inertia: Principal moments, shape (3,) [kg·m²].
        """
        self._mass, self._inertia = np.reshape(world.mass, (1,)), np.array(inertia)
        self._drag = float(world.drag)
        self._offset = np.array([float(world.com_x), float(world.com_y), 0.0])
        moments = np.cross(self._places - self._offset, self._directions)
        self._per_newton = np.concatenate((self._directions, moments), axis=1)

    def wrench(
        self,
        height: np.ndarray,
        to_world: np.ndarray,
        qvel: np.ndarray,
        thrusts: np.ndarray,
        outside: np.ndarray,
    ) -> np.ndarray:
        """What to apply to the body beside its actuators and its weight.

        Args:
            height: Of the body's origin, shape (...,) [m].
            to_world: Rotation from the body's frame to the world's, shape (..., 3, 3).
            qvel: Velocities as MuJoCo has them of a free joint, shape (..., 6).
            thrusts: The coming ones of the actuators, shape (..., n) [N].
            outside: Push of the surroundings in the world's frame, shape (..., 6) [N, N·m].

        Returns:
            Force and moment about the centre of mass in the world's frame, shape (..., 6) [N, N·m].
        """
        omega = qvel[..., 3:]
        ahead = (qvel[..., None, :3] @ to_world)[..., 0, :] + cross(omega, self._offset)
        velocity = np.concatenate((ahead, omega), axis=-1)
        weight = GRAVITY * self._mass[0]
        up = to_world[..., 2, :]  # in the body's frame
        buoyancy, righting = self._water.hydrostatics.wrench(height, up, weight)
        thrust = thrusts @ self._per_newton
        total = self._drag * self._water.damping(velocity) + thrust + _turned(outside, to_world)
        total[..., :3] += (buoyancy - weight)[..., None] * up
        total[..., 3:] += righting
        felt = self._water.with_added_mass(total, velocity, self._mass, self._inertia) - thrust
        felt[..., :3] += weight * up
        return _turned(felt, to_world.swapaxes(-1, -2))


def _turned(wrench: np.ndarray, rotation: np.ndarray) -> np.ndarray:
    """Force and moment as rows, each times the rotation."""
    turned: np.ndarray = (wrench.reshape(*wrench.shape[:-1], 2, 3) @ rotation).reshape(wrench.shape)
    return turned
