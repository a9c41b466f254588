"""Robots that forces push in MuJoCo: on air, in space or on water."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

from fulmar_core.robots.actuators.pushing import Push, Pushing
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.urdf import PART_COLOUR
from sim_nodes.mujoco_model.scenery import BODY, add_body
from sim_nodes.mujoco_model.water import Water

# MuJoCo compiles a body whose centre of mass is its origin in a way that keeps it there [m].
OFF_CENTRE = 1e-5


class Floater:
    """One body under forces at fixed places.

    A planar robot gets two slides and a hinge and stands on a floor under gravity, which holds it up but pushes
    nowhere. A robot with hydrodynamics swims. Any other robot moves freely. Each actuator pushes at its place along its
    direction, turns the body about that by its couple, and takes newtons.

    Attributes:
        water: That a robot with hydrodynamics swims in; None for any other.
    """

    steps_per_tick = 1
    in_space = False

    @property
    def steady(self) -> bool:
        """Whether forces change with nothing but what the actuators do; those of water change with every step."""
        return self.water is None

    def __init__(self, robot: Robot) -> None:
        self._robot, self._actuators = robot, robot.actuated_by(Pushing)
        self._body = 0
        self._planar, self._swims = robot.body.planar, robot.hydrodynamics is not None
        self.water: Water | None = None
        if robot.hydrodynamics is not None:
            pushes = self._actuators.pushes
            places = np.array([push.position for push in pushes])
            self.water = Water(robot.hydrodynamics, places, np.array([push.direction for push in pushes]))

    @property
    def rest_height(self) -> float:
        """The floor is at z = 0, and so is still water."""
        return 0.5 * self._robot.body.height if self._planar and not self._swims else 0.0

    def add(self, spec: mujoco.MjSpec) -> mujoco.MjsBody:
        """Add the body; see `RobotModel.add`."""
        body = add_body(spec, self._robot, self.rest_height, floats=not self._planar)
        if self._planar:
            body.add_joint(name="x", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[1, 0, 0])
            body.add_joint(name="y", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[0, 1, 0])
            body.add_joint(name="yaw", type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, 0, 1])
        body.ipos = [OFF_CENTRE, 0.0, 0.0]
        for push in self._actuators.pushes:
            _add_push(spec, body, push)
        return body

    def bind(self, model: mujoco.MjModel) -> None:
        """Look up the body."""
        self._body = model.body(BODY).id

    def take_world(self, model: mujoco.MjModel, world: Any) -> None:
        """Take mass, inertia and centre of mass; the whole inertia grows and shrinks with that about z."""
        nominal = np.array(self._robot.body.inertia)
        model.body_mass[self._body] = world.mass
        model.body_inertia[self._body] = nominal * (world.yaw_inertia / nominal[2])
        model.body_ipos[self._body] = (world.com_x, world.com_y, 0.0)
        if self.water is not None:
            self.water.take_world(world, model.body_inertia[self._body])

    def own_truth(self, data: mujoco.MjData) -> dict[str, Any]:
        """Nothing: see `RobotModel.own_truth`."""
        return {}

    def place(self, model: mujoco.MjModel, data: mujoco.MjData, start: Any) -> None:
        """Put the body where it starts, upright and at rest height."""
        if self._planar:
            data.qpos[:3] = start.x, start.y, start.yaw
            data.qvel[:3] = start.vx, start.vy, start.yaw_rate
        else:
            half = 0.5 * float(start.yaw)
            data.qpos[:7] = start.x, start.y, self.rest_height, np.cos(half), 0.0, 0.0, np.sin(half)
            data.qvel[:6] = start.vx, start.vy, 0.0, 0.0, 0.0, start.yaw_rate

    def drive(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        applied: np.ndarray,
        gain: np.ndarray,
        outside: tuple[float, ...],
    ) -> None:
        """Set thrusts, the push of the surroundings and the forces of the water; see `RobotModel.drive`."""
        data.ctrl[:] = self._actuators.thrusts(applied) * gain
        fx, fy, torque = outside
        push = np.array((fx, fy, 0.0, 0.0, 0.0, torque))
        if self.water is None:
            data.xfrc_applied[self._body] = push
            return
        rotation = np.empty(9)
        mujoco.mju_quat2Mat(rotation, data.qpos[3:7])
        data.xfrc_applied[self._body] = self.water.wrench(
            data.qpos[2], rotation.reshape(3, 3), data.qvel[:6], data.ctrl, push
        )


def _add_push(spec: mujoco.MjSpec, body: mujoco.MjsBody, push: Push) -> None:
    body.add_site(name=push.name, pos=list(push.position), size=[0.02, 0.02, 0.02], rgba=list(PART_COLOUR))
    couple = [push.couple * part + 0.0 for part in push.direction]
    add_actuator(spec, push.name, push.name, [*push.direction, *couple])


def add_actuator(spec: mujoco.MjSpec, name: str, site: str, gear: list[float]) -> None:
    """Add an actuator that applies its control times a wrench at a site, in the site's frame [N, N·m]."""
    spec.add_actuator(
        name=name,
        trntype=mujoco.mjtTrn.mjTRN_SITE,
        target=site,
        gear=gear,
        gaintype=mujoco.mjtGain.mjGAIN_FIXED,
        biastype=mujoco.mjtBias.mjBIAS_NONE,
        dyntype=mujoco.mjtDyn.mjDYN_NONE,
    )
