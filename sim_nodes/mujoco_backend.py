"""MuJoCo as a backend: it integrates the bodies, the core supplies forces, noise and names."""

from __future__ import annotations

import mujoco
import numpy as np

from fulmar_core.backend import Sample
from fulmar_core.disturbances.scenario import World
from fulmar_core.episode import NOISE, episode_rng
from fulmar_core.errors import SafetyError
from fulmar_core.robot import Robot
from fulmar_core.sensors.imu import ImuSample, measure_imu
from fulmar_core.sensors.odometry import measure_odometry
from fulmar_core.state import RigidBodyState
from sim_nodes.mujoco_model import BODY, build_model


class MujocoBackend:
    """One robot in MuJoCo."""

    def __init__(self, robot: Robot, *, sensor_noise: bool = True) -> None:
        """Build the model.

        Args:
            robot: The robot.
            sensor_noise: Whether odometry and inertial unit have the noise of the robot's YAML.
        """
        self.robot = robot
        self.model = build_model(robot)
        self.data = mujoco.MjData(self.model)
        self._noisy = sensor_noise
        self._rng = episode_rng(0, 0, stream=NOISE)
        self._body = self.model.body(BODY).id
        self._height = float(self.model.body(BODY).pos[2])
        self._at = {
            name: slice(int(self.model.sensor(name).adr[0]), int(self.model.sensor(name).adr[0] + width))
            for name, width in (
                ("position", 3),
                ("attitude", 4),
                ("velocity", 3),
                ("gyroscope", 3),
                ("accelerometer", 3),
            )
        }

    def reset(self, start: RigidBodyState, world: World, *, seed: int, number: int = 0) -> Sample:
        """Begin anew; see `Backend.reset`."""
        self._rng = episode_rng(seed, number, stream=NOISE)
        self.model.body_mass[self._body] = world.mass
        self.model.body_inertia[self._body] = world.inertia
        mujoco.mj_setConst(self.model, self.data)
        mujoco.mj_resetData(self.model, self.data)
        x, y, z, w = start.quat_xyzw
        omega = start.angular_velocity_in_body
        if self.robot.body.planar:
            self.data.qpos[:] = (*start.position_in_world[:2], float(start.yaw))
            self.data.qvel[:] = (*start.velocity_in_world[:2], omega[2])
        else:
            self.data.qpos[:] = (*start.position_in_world, w, x, y, z)
            self.data.qvel[:] = (*start.velocity_in_world, *omega)
        self.data.xfrc_applied[self._body] = (*world.force_in_world, *world.torque_in_world)
        return self._sample()

    def step(self, command: np.ndarray, ticks: int = 1) -> Sample:
        """Apply a command; see `Backend.step`.

        Raises:
            SafetyError: If the simulation left the finite numbers, with the state it had.
        """
        self.data.ctrl[:] = self.robot.actuators.thrusts(np.asarray(command, dtype=float))
        mujoco.mj_step(self.model, self.data, ticks)
        if not np.isfinite(self.data.qpos).all():
            raise SafetyError(
                f"MuJoCo's state is not finite at t = {self.data.time:.2f} s: {self.data.qpos}."
            )
        return self._sample()

    def make_safe(self) -> None:
        """Close the valves."""
        self.data.ctrl[:] = 0.0

    def close(self) -> None:
        """Close the valves; MuJoCo itself needs no closing."""
        self.make_safe()

    def _sample(self) -> Sample:
        # mj_step leaves the sensors as they were before its last integration step.
        mujoco.mj_forward(self.model, self.data)
        read = {name: np.array(self.data.sensordata[at]) for name, at in self._at.items()}
        position = read["position"]
        if self.robot.body.planar:
            position[2] -= self._height
        w, x, y, z = read["attitude"]
        truth = RigidBodyState(position, np.array([x, y, z, w]), read["velocity"], read["gyroscope"])
        imu = ImuSample(read["accelerometer"], read["gyroscope"])
        if not self._noisy:
            return Sample(truth, imu, truth)
        sensors = self.robot.sensors
        return Sample(
            measure_odometry(truth, sensors.odometry, self._rng),
            measure_imu(imu, sensors.imu, self._rng),
            truth,
        )
