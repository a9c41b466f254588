"""Satellites in MuJoCo: a free body that carries wheels on hinges, each with a motor.

MuJoCo computes the exchange of momentum between wheels and body by itself. Wheels are balls of the spin inertia, so
that the body that carries them has a fixed inertia of its own.
"""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

from fulmar_core.robots.actuators.reaction_wheels import ReactionWheels
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.sensors.wheels import NAME as WHEELS
from fulmar_core.robots.sensors.wheels import WheelSpeeds
from fulmar_core.states.attitude import turn_back
from fulmar_core.worlds.spatial_world import SpatialWorld
from sim_nodes.mujoco_model.free_body import FreeBody, tensor_of
from sim_nodes.mujoco_model.scenery import BODY, add_body

WHEEL_MASS = 1e-3  # of the body, each; they sit in its middle, where their mass turns nothing [-]


class Satellite(FreeBody):
    """One body on a free joint, without gravity, with reaction wheels; see `RobotModel`."""

    steps_per_tick = 1
    steady = False  # the torque of a motor ends at the top speed of its wheel, and the body turns in the magnetic field
    rest_height = 0.0

    def __init__(self, robot: Robot) -> None:
        self._robot, self._wheels = robot, robot.actuated_by(ReactionWheels)
        self._body = 0
        self._spins = np.zeros(0, dtype=int)
        unloading = self._wheels.unloading
        self._magnetic = unloading is not None and unloading.kind == "magnetic"
        self._inertia = robot.body.inertia_matrix

    def add(self, spec: mujoco.MjSpec) -> mujoco.MjsBody:
        """Add the body and its wheels; see `RobotModel.add`."""
        robot, wheels = self._robot, self._wheels
        body = add_body(spec, robot)
        body.mass = robot.body.mass * (1.0 - WHEEL_MASS * wheels.count)
        body.inertia = (np.array(robot.body.inertia[:3]) - wheels.count * wheels.spin_inertia).tolist()
        for wheel in wheels.wheels:
            part = body.add_body(name=wheel.name)
            part.add_joint(name=wheel.name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=wheel.direction.tolist())
            part.explicitinertial = True
            part.mass = WHEEL_MASS * robot.body.mass
            part.ipos, part.iquat = [0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]
            part.inertia = [wheels.spin_inertia] * 3
            spec.add_actuator(
                name=wheel.name,
                trntype=mujoco.mjtTrn.mjTRN_JOINT,
                target=wheel.name,
                gaintype=mujoco.mjtGain.mjGAIN_FIXED,
                biastype=mujoco.mjtBias.mjBIAS_NONE,
                dyntype=mujoco.mjtDyn.mjDYN_NONE,
            )
        return body

    def bind(self, model: mujoco.MjModel) -> None:
        """Look up the body and the speeds of the wheels."""
        self._body = model.body(BODY).id
        self._spins = np.array([model.joint(wheel.name).dofadr[0] for wheel in self._wheels.wheels])

    def take_world(self, model: mujoco.MjModel, world: SpatialWorld) -> None:
        """Take mass and inertia."""
        self._inertia = tensor_of(world)
        rest = sum(model.body_mass) - model.body_mass[self._body]
        model.body_mass[self._body] = float(world.mass) - rest
        self._set_inertia(model, 1.0)

    def _set_inertia(self, model: mujoco.MjModel, growth: float) -> None:
        """Give the body what the spacecraft has with its wheels locked, less the wheels' own."""
        wheels = self._wheels
        hub = growth * self._inertia - wheels.count * wheels.spin_inertia * np.eye(3)
        self.set_inertia(model, hub)
        self._growth = growth

    def own_truth(self, data: mujoco.MjData) -> dict[str, Any]:
        """Speeds of the wheels."""
        return {WHEELS: self.wheel_speeds(data)}

    def wheel_speeds(self, data: mujoco.MjData) -> WheelSpeeds:
        """Of each wheel relative to the body."""
        return WheelSpeeds(self._wheels.wheel_names, np.array(data.qvel[self._spins]))

    def drive(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        applied: np.ndarray,
        gain: np.ndarray,
        outside: tuple[float, ...],
    ) -> None:
        """Set motor torques and the push of the surroundings; see `RobotModel.drive`."""
        wheels, doing = self._wheels, applied * gain
        if len(outside) > 3 and outside[9] != self._growth:
            self._set_inertia(model, outside[9])
        speeds = data.qvel[self._spins]
        motors = wheels.motor_torque(doing[: wheels.count], speeds, self._robot.timing.physics_dt)
        data.ctrl[:] = motors + wheels.friction_torque(speeds)
        data.xfrc_applied[self._body, :3] = outside[:3]
        w, x, y, z = data.qpos[3:7]
        torque = np.array(outside[3:6]) if len(outside) > 3 else np.zeros(3)
        here = (
            turn_back((x, y, z, w), (outside[6], outside[7], outside[8]))
            if self._magnetic and len(outside) > 3
            else None
        )
        unloading = wheels.unloading_torque(doing, here)
        if unloading is not None:
            torque = torque + np.array(unloading)
        turned = np.empty(3)
        mujoco.mju_rotVecQuat(turned, torque, data.qpos[3:7])
        data.xfrc_applied[self._body, 3:] = turned
