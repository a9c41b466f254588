"""Robots that actuators push in space in MuJoCo."""

from __future__ import annotations

import mujoco
import numpy as np

from fulmar_core.robots.robot import Robot
from fulmar_core.worlds.spatial_world import SpatialWorld
from sim_nodes.mujoco_model.floater import Floater, add_actuator
from sim_nodes.mujoco_model.free_body import FreeBody, tensor_of

TORQUE_SITE = "torque"  # where the torque of the surroundings acts


class FreeFlyer(FreeBody, Floater):
    """One body on a free joint, under forces at fixed places, a push of the surroundings and its weight, if any.

    Three more actuators apply the torque of an episode about the body's axes: a constant one, and that of an orbit.
    """

    def __init__(self, robot: Robot) -> None:
        super().__init__(robot)
        self._torque = np.zeros(3)  # on the body, in its own frame [N·m]

    def add(self, spec: mujoco.MjSpec) -> mujoco.MjsBody:
        """Add the body; see `RobotModel.add`."""
        body = super().add(spec)
        for axis, gear in zip("xyz", np.eye(3), strict=True):
            add_actuator(spec, f"torque_{axis}", TORQUE_SITE, [0.0, 0.0, 0.0, *gear])
        body.add_site(name=TORQUE_SITE, pos=[0.0, 0.0, 0.0])
        return body

    def take_world(self, model: mujoco.MjModel, world: SpatialWorld) -> None:
        """Take mass, inertia, centre of mass, constant torque, and what thrusters make of a command."""
        self.set_inertia(model, tensor_of(world))
        model.body_mass[self._body], model.body_ipos[self._body] = world.mass, world.com
        self._torque = np.array(world.torque, dtype=float)
        if world.effects is not None:
            # Actuators take newtons of the robot's own thrusters, at whose places they push.
            for gear, site, wrench, newtons in zip(
                model.actuator_gear, model.actuator_trnid[:, 0], np.asarray(world.effects), self._actuators.full_thrust,
                strict=False,
            ):  # fmt: skip
                force = wrench[:3] / newtons
                gear[:] = *force, *(wrench[3:] / newtons - np.cross(model.site_pos[site], force))

    def drive(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        applied: np.ndarray,
        gain: np.ndarray,
        outside: tuple[float, ...],
    ) -> None:
        """Set thrusts and the push of the surroundings; see `RobotModel.drive`."""
        torque = self._torque + outside[3:] if len(outside) > 3 else self._torque
        data.ctrl[:-3], data.ctrl[-3:] = self._actuators.thrusts(applied) * gain, torque
        data.xfrc_applied[self._body, :3] = outside[:3]
