"""Aircraft in MuJoCo: it integrates a free body under gravity; the core supplies the forces of air and propellers."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

from fulmar_core.dynamics.actuators.actuation import ActuationState
from fulmar_core.dynamics.flight_dynamics import FlightDynamics
from fulmar_core.dynamics.rigid_body import inertia_of
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.sensors.air_data import NAME as AIR
from fulmar_core.states.attitude import plus
from fulmar_core.states.gravity import GRAVITY
from fulmar_core.states.spatial import SpatialState
from fulmar_core.worlds.turbulence import Gust
from sim_nodes.mujoco_model.floater import OFF_CENTRE
from sim_nodes.mujoco_model.free_body import FreeBody, tensor_of
from sim_nodes.mujoco_model.scenery import BODY, add_body

STEPS = 2  # of MuJoCo in a physics tick, each with the forces of where the craft is by then


class Aircraft(FreeBody):
    """One body on a free joint; see `RobotModel`."""

    steps_per_tick = STEPS
    steady = False
    rest_height = 0.0

    def __init__(self, robot: Robot) -> None:
        self._robot, self._dynamics = robot, FlightDynamics(robot)
        self._body = 0
        self._world: Any = None
        self._actuation: ActuationState | None = None
        self._gust: Gust | None = None
        self._tick = -1

    def add(self, spec: mujoco.MjSpec) -> mujoco.MjsBody:
        """Add the body; see `RobotModel.add`."""
        robot = self._robot
        body = add_body(spec, robot)
        body.ipos = [OFF_CENTRE, 0.0, 0.0]
        if robot.body.as_printed:
            body.inertia = [max(robot.body.inertia[:3])] * 3
        return body

    def bind(self, model: mujoco.MjModel) -> None:
        """Look up the body."""
        self._body = model.body(BODY).id

    def take_world(self, model: mujoco.MjModel, world: Any) -> None:
        """Take mass and inertia."""
        self.set_inertia(model, tensor_of(world))
        model.body_mass[self._body], model.body_ipos[self._body] = world.mass, 0.0

    def fly_in(self, world: Any, actuation: ActuationState) -> None:
        """Take the air of an episode, a `FlightWorld`, and what remembers its gusts, each of a batch of one."""
        self._world, self._actuation = world, actuation
        self._air, self._turbulent = world.in_numbers(), bool(world.turbulence.any())
        self._inertia = inertia_of(tuple(self._air.inertia))
        self._tick, self._gust = -1, None

    def own_truth(self, data: mujoco.MjData) -> dict[str, Any]:
        """What air probes would measure without errors."""
        return {AIR: self._dynamics.air_data(self._state(data), self._gust, self._air)}

    def drive(
        self, model: mujoco.MjModel, data: mujoco.MjData, applied: np.ndarray, gain: np.ndarray, outside: Any
    ) -> None:
        """Set the forces of the coming step; see `RobotModel.drive`. What flies no longer stops there."""
        state = self._state(data)
        if not self._dynamics.is_aloft(state):
            data.qvel[:] = 0.0
            data.xfrc_applied[self._body] = 0.0, 0.0, model.body_mass[self._body] * GRAVITY, 0.0, 0.0, 0.0
            return
        tick = round(data.time / model.opt.timestep) // STEPS
        if tick != self._tick:
            self._tick, self._gust = tick, self._blown(state)
        applied_now = (applied * gain).tolist()
        force, torque = self._dynamics.wrench(state, applied_now, self._gust, self._air, self._inertia)
        push, turn = np.empty(3), np.empty(3)
        mujoco.mju_rotVecQuat(push, np.array(force), data.qpos[3:7])
        mujoco.mju_rotVecQuat(turn, np.array(plus(torque, tuple(self._air.torque))), data.qpos[3:7])
        data.xfrc_applied[self._body] = *(push + outside[:3]), *turn

    def _blown(self, state: SpatialState) -> Gust | None:
        """The gust of a tick in plain numbers; None in calm air, where it is nothing."""
        assert self._actuation is not None  # as in `fly_in`
        if not self._turbulent:
            return None
        dt = self._robot.timing.physics_dt
        gust = self._dynamics.gust(state.in_arrays(), self._actuation, self._world, dt)
        return None if gust is None else tuple(float(part[0]) for part in gust)  # type: ignore[return-value]

    def _state(self, data: mujoco.MjData) -> SpatialState:
        """In plain numbers."""
        x, y, z, w, qx, qy, qz = data.qpos[:7].tolist()
        return SpatialState(x, y, z, qx, qy, qz, w, *data.qvel[:6].tolist())
