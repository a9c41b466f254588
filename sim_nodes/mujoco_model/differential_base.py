"""Two driven wheels on one axle, and casters that keep the body level."""

from __future__ import annotations

import mujoco
import numpy as np

from fulmar_core.robots.actuators.differential_drive import DifferentialDrive
from fulmar_core.robots.robot import Robot
from fulmar_core.states.planar import PlanarState, PlanarWrench
from sim_nodes.mujoco_model.wheels import Chassis

# How far the weight lies from the axle towards a single caster, which has to carry some; our value [-].
WEIGHT_TO_CASTER = 0.15


class DifferentialBase(Chassis):
    """Wheels that follow their speeds with the lag of the YAML, as hard as `wheel_force` allows."""

    def __init__(self, robot: Robot) -> None:
        self._drive = robot.actuated_by(DifferentialDrive)
        weight_x = min(0.0, WEIGHT_TO_CASTER * self._drive.caster_x)
        super().__init__(robot, self._drive, weight_x=weight_x)

    def add(self, spec: mujoco.MjSpec) -> mujoco.MjsBody:
        """Add chassis, wheels, casters and servos; see `RobotModel.add`."""
        drive, body = self._drive, super().add(spec)
        for name, (x, y) in self.places.items():
            self.add_wheel(body, name, (x, y, 0.0))
        for name, x in drive.casters.items():
            self.add_caster(body, name, x)
        for wheel in self.places:
            self.add_wheel_servo(spec, wheel, force=drive.wheel_force, response=drive.response)
        return body

    def place(self, model: mujoco.MjModel, data: mujoco.MjData, start: PlanarState) -> None:
        """See `RobotModel.place`."""
        super().place(model, data, start)
        ahead, _ = start.velocity_in_body
        data.qvel[6:8] = data.act[:] = self._drive.wheel_speeds(np.array([ahead, start.yaw_rate]))

    def drive(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        applied: np.ndarray,
        gain: np.ndarray,
        outside: PlanarWrench,
    ) -> None:
        """Set the speeds of the wheels; see `RobotModel.drive`."""
        data.ctrl[:] = self._drive.wheel_speeds(applied * gain)
        self.push(data, outside)
