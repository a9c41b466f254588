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

    def __init__(self, hydrodynamics: Hydrodynamics) -> None:
        """Take what the hull is like."""
        self._water = hydrodynamics
        self._mass, self._inertia, self._drag = np.ones(1), np.ones(3), 1.0
        self._offset = np.zeros(3)

    def take_world(self, world: World, inertia: np.ndarray) -> None:
        """Take the body of an episode.

        Args:
            world: Mass, centre of mass and the factor on the drag, without a batch axis.
            inertia: Principal moments, shape (3,) [kg·m²].
        """
        self._mass, self._inertia = np.reshape(world.mass, (1,)), np.array(inertia)
        self._drag = float(world.drag)
        self._offset = np.array([float(world.com_x), float(world.com_y), 0.0])

    def wrench(
        self, model: mujoco.MjModel, data: mujoco.MjData, body: int, outside: np.ndarray
    ) -> np.ndarray:
        """What to apply to the body beside its actuators and its weight.

        Args:
            model: The model; the body has a free joint.
            data: Its state, with the thrusts of the coming step in `ctrl`.
            body: Number of the body.
            outside: Push of the surroundings in the world's frame, shape (6,).

        Returns:
            Force and moment about the centre of mass in the world's frame, shape (6,) [N, N·m].
        """
        rotation = np.empty(9)
        mujoco.mju_quat2Mat(rotation, data.qpos[3:7])
        to_body = rotation.reshape(3, 3).T
        omega = data.qvel[3:6]
        velocity = np.concatenate((to_body @ data.qvel[:3] + _cross(omega, self._offset), omega))
        weight = GRAVITY * self._mass[0]
        up = to_body[:, 2]
        buoyancy, righting = self._water.hydrostatics.wrench(data.qpos[2], up, weight)
        thrust = self._thrust(model, data)
        total = self._drag * self._water.damping(velocity) + thrust
        total[:3] += to_body @ outside[:3] + (buoyancy - weight) * up
        total[3:] += to_body @ outside[3:] + righting
        felt = self._water.with_added_mass(total, velocity, self._mass, self._inertia) - thrust
        felt[:3] += weight * up
        return np.concatenate((felt[:3] @ to_body, felt[3:] @ to_body))

    def _thrust(self, model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
        """Of the actuators, about the centre of mass in the body's frame, shape (6,)."""
        places = model.site_pos[model.actuator_trnid[:, 0]] - self._offset
        forces = model.actuator_gear[:, :3] * data.ctrl[:, None]
        return np.concatenate((forces.sum(axis=0), np.cross(places, forces).sum(axis=0)))


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])
