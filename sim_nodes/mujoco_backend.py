"""MuJoCo as a backend: it integrates the bodies; the core supplies actuators, disturbances and sensors."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import mujoco
import numpy as np

from fulmar_core.config.errors import SafetyError
from fulmar_core.dynamics.motion import left_of
from fulmar_core.dynamics.things import Thing
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.sensors.kind import Truth
from fulmar_core.robots.sensors.simulated import SimulatedSensors
from fulmar_core.simulation.backend import Sample
from fulmar_core.simulation.episode import Episode
from fulmar_core.states.state import RigidBodyState
from fulmar_core.tasks import Task
from fulmar_core.wires.reading import Reading
from fulmar_core.worlds.scenario import Scenario, sensors_in
from fulmar_core.worlds.structures import Structure
from sim_nodes.mujoco_model import Scene
from sim_nodes.mujoco_model.aircraft import Aircraft
from sim_nodes.mujoco_model.objects import radii_for
from sim_nodes.one_world import OneWorld

READ_OUT = (("position", 3), ("attitude", 4), ("velocity", 3), ("gyroscope", 3), ("accelerometer", 3))


class MujocoBackend:
    """One robot in MuJoCo."""

    def __init__(
        self,
        robot: Robot,
        *,
        sensor_noise: bool = True,
        things: tuple[Thing, ...] = (),
        structures: tuple[Structure, ...] = (),
        sensors: Mapping[str, Any] | None = None,
    ) -> None:
        """Build it; `sensors` by name in the place of those of the robot's file."""
        self.robot = robot
        self._things, self._structures = things, structures
        self._sensors = SimulatedSensors(sensors or robot.sensors.specs, noisy=sensor_noise)
        self._world = OneWorld(robot, noisy=sensor_noise)
        self._use(Scene(robot, things=things, structures=structures))

    @classmethod
    def of(cls, robot: Robot, task: Task, scenario: Scenario) -> MujocoBackend:
        """The simulator that a task and a scenario ask for."""
        sensors = sensors_in(robot, scenario)
        return cls(
            robot,
            sensor_noise=scenario.sensor_noise,
            things=task.things,
            structures=task.structures,
            sensors=sensors,
        )

    @property
    def model(self) -> mujoco.MjModel:
        """The compiled model; another one after a reset with other obstacles."""
        return self._scene.model

    @property
    def data(self) -> mujoco.MjData:
        """Its state."""
        return self._scene.data

    def reset(self, episode: Episode, *, seed: int, number: int = 0) -> Sample:
        """Begin anew; see `Backend.reset`."""
        obstacles = np.asarray(episode.goal.obstacles, dtype=float)
        if not self._scene.has_room_for(obstacles):
            self._use(Scene(self.robot, radii_for(obstacles), self._things, self._structures))
        self._scene.begin(episode)
        self._sensors.reset(seed, number)
        self._world.begin_episode(episode)
        if isinstance(self._scene.robot_model, Aircraft):
            self._scene.robot_model.fly_in(self._world.world, self._world.actuation)
        truth = self._read()
        return self._sample(truth, self._world.first_measurement(truth.state, seed=seed, number=number))

    def step(self, command: np.ndarray, ticks: int = 1, *, begins: int | None = None) -> Sample:
        """Apply a command; see `Backend.step`.

        Raises:
            SafetyError: The state is not finite; the message has it.
        """
        model, data, robot_model, world = self.model, self.data, self._scene.robot_model, self._world
        world.begin(np.asarray(command, dtype=float), ticks, self._truth, begins=begins)
        outside = tuple(float(part[0]) for part in world.outside)
        dt = self.robot.timing.physics_dt
        last, lost = None, world.actuation.lost
        for _ in range(ticks):
            applied = world.actuation.advance(dt, latest_s=world.latest_s)
            if lost is not None:
                share, lost = left_of(world.world.mass, lost, world.actuation.lost)
                self._scene.lighten(float(share[0]))
            if not robot_model.steady:
                for _ in range(robot_model.steps_per_tick):
                    robot_model.drive(model, data, applied[:, 0], world.actuation.gain[:, 0], outside)
                    mujoco.mj_step(model, data)
                continue
            if applied is not last:
                robot_model.drive(model, data, applied[:, 0], world.actuation.gain[:, 0], outside)
                last = applied
            mujoco.mj_step(model, data, robot_model.steps_per_tick)
        if not np.isfinite(data.qpos).all():
            raise SafetyError(f"MuJoCo's state is not finite at t = {data.time:.2f} s: {data.qpos}.")
        truth = self._read()
        return self._sample(truth, world.measure(truth.state))

    def stand(self, ticks: int = 1, *, begins: int | None = None) -> Sample:
        """Let time pass for a body that nothing moves; see `CanStand.stand`."""
        data, world, rest = self.data, self._world, np.array(self.robot.actuators.safe_command, dtype=float)
        world.begin(rest, ticks, self._truth, begins=begins)
        dt = self.robot.timing.physics_dt
        for _ in range(ticks):
            world.actuation.advance(dt, latest_s=world.latest_s)
        self._scene.robot_model.drive(self.model, data, rest, world.actuation.gain[:, 0], (0.0, 0.0, 0.0))
        data.qvel[:] = 0.0
        data.time += ticks * dt
        truth = self._read()
        return self._sample(truth, world.measure(truth.state))

    def push(self, force: tuple[float, ...] | None) -> None:
        """See `CanPush.push`."""
        self._world.extra = force

    def place(self, state: RigidBodyState) -> None:
        """See `CanPlace.place`."""
        self._scene.place(self.robot.state_type.from_rigid(state))
        self._truth = self._read().state

    def make_safe(self) -> None:
        """Bring the actuators to rest."""
        self.data.ctrl[:] = 0.0

    def close(self) -> None:
        """Bring the actuators to rest; MuJoCo itself needs no closing."""
        self.make_safe()

    def _use(self, scene: Scene) -> None:
        self._scene = scene
        self._at = {
            name: slice(int(scene.model.sensor(name).adr[0]), int(scene.model.sensor(name).adr[0]) + width)
            for name, width in READ_OUT
        }

    def _read(self) -> Truth:
        """True motion."""
        # mj_step leaves the sensors as they were before its last integration step.
        mujoco.mj_forward(self.model, self.data)
        every = np.array(self.data.sensordata)
        read = {name: every[at] for name, at in self._at.items()}
        position = read["position"]
        position[2] -= self._scene.robot_model.rest_height
        w, x, y, z = read["attitude"]
        state = RigidBodyState(position, np.array([x, y, z, w]), read["velocity"], read["gyroscope"])
        more = self._world.actuation.truths() | self._scene.robot_model.own_truth(self.data)
        return Truth(state, read["accelerometer"], more)

    def _sample(self, truth: Truth, odometry: RigidBodyState) -> Sample:
        self._truth = truth.state
        others = self._sensors.measure(truth, self.data.time)
        return Sample({"odometry": Reading(odometry), **others}, truth.state, self._scene.things)
