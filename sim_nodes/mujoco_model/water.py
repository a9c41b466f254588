"""Still water about a hull in MuJoCo: the core's formulas, as an outside force at every step."""

from __future__ import annotations

import mujoco
import numpy as np

from fulmar_core.disturbances.world import World
from fulmar_core.dynamics.hydrodynamics import GRAVITY, Hydrodynamics


class Water:
    """Buoyancy, righting moments, drag and added mass.

    Still water is at z = 0, where the hull floats at rest whatever it weighs in an episode.
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

    def wrench(self, data: mujoco.MjData, outside: tuple[float, ...]) -> np.ndarray:
        """What to apply to the body beside its actuators and its weight.

        Args:
            data: State of a model whose first joint is the body's free one, with the coming thrusts in `ctrl`.
            outside: Push of the surroundings in the world's frame, six numbers [N, N·m].

        Returns:
            Force and moment about the centre of mass in the world's frame, shape (6,) [N, N·m].
        """
        rotation = np.empty(9)
        mujoco.mju_quat2Mat(rotation, data.qpos[3:7])
        to_world = rotation.reshape(3, 3)
        omega = data.qvel[3:6]
        velocity = np.concatenate((data.qvel[:3] @ to_world + _cross(omega, self._offset), omega))
        weight = GRAVITY * self._mass[0]
        up = to_world[2]  # in the body's frame
        buoyancy, righting = self._water.hydrostatics.wrench(data.qpos[2], up, weight)
        thrust = data.ctrl @ self._per_newton
        total = self._drag * self._water.damping(velocity) + thrust
        total[:3] += outside[:3] @ to_world + (buoyancy - weight) * up
        total[3:] += outside[3:] @ to_world + righting
        felt = self._water.with_added_mass(total, velocity, self._mass, self._inertia) - thrust
        felt[:3] += weight * up
        return np.concatenate((to_world @ felt[:3], to_world @ felt[3:]))


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])
