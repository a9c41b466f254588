"""Two driven wheels on one axle, and casters that keep the body level."""

from __future__ import annotations

import mujoco
import numpy as np

from fulmar_core.actuators.differential_drive import DifferentialDrive
from fulmar_core.disturbances.world import World
from fulmar_core.planar import PlanarState
from fulmar_core.robot import Robot
from sim_nodes.mujoco_model.wheels import STEP_S, Chassis, add_wheel_servo

# How far the weight lies from the axle towards a single caster, which has to carry some; our value [-].
WEIGHT_TO_CASTER = 0.15


class DifferentialBase:
    """Wheels that follow their speeds with the lag of the YAML, as hard as `wheel_force` allows."""

    def __init__(self, robot: Robot) -> None:
        """Prepare for `add`."""
        assert isinstance(robot.actuators, DifferentialDrive)
        self._robot, self._drive = robot, robot.actuators
        self.steps_per_tick = max(1, round(robot.timing.physics_dt / STEP_S))
        half = 0.5 * self._drive.track
        self._chassis = Chassis(
            robot,
            wheel_radius=self._drive.wheel_radius,
            friction=self._drive.friction,
            wheels={"left_wheel": (0.0, half), "right_wheel": (0.0, -half)},
            weight_x=min(0.0, WEIGHT_TO_CASTER * self._drive.caster_x),
        )

    @property
    def steady(self) -> bool:
        """The floor's forces are MuJoCo's own."""
        return True

    @property
    def rest_height(self) -> float:
        """Height of the axle [m]."""
        return self._chassis.rest_height

    def add(self, spec: mujoco.MjSpec) -> mujoco.MjsBody:
        """Add chassis, wheels, casters and servos; see `Machine.add`."""
        drive, chassis = self._drive, self._chassis
        body = chassis.add(spec)
        for name, (x, y) in chassis.places.items():
            chassis.add_wheel(body, name, (x, y, 0.0))
        chassis.add_caster(body, "rear_caster", -abs(drive.caster_x))
        if drive.caster_x > 0.0:
            chassis.add_caster(body, "front_caster", drive.caster_x)
        for wheel in chassis.places:
            add_wheel_servo(spec, wheel, chassis, force=drive.wheel_force, response=drive.response)
        return body

    def bind(self, model: mujoco.MjModel) -> None:
        """See `Machine.bind`."""
        self._chassis.bind(model)

    def take_world(self, model: mujoco.MjModel, world: World) -> None:
        """See `Machine.take_world`."""
        self._chassis.take_world(model, world)

    def place(self, model: mujoco.MjModel, data: mujoco.MjData, start: PlanarState) -> None:
        """See `Machine.place`."""
        self._chassis.place(model, data, start)
        ahead, _ = start.velocity_in_body
        data.qvel[6:8] = data.act[:] = self._drive.wheel_speeds(np.array([ahead, start.yaw_rate]))

    def drive(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        applied: np.ndarray,
        gain: np.ndarray,
        outside: tuple[float, float, float],
    ) -> None:
        """Set the speeds of the wheels; see `Machine.drive`."""
        data.ctrl[:] = self._drive.wheel_speeds(applied * gain)
        self._chassis.push(data, outside)
