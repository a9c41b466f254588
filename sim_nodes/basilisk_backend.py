"""Basilisk as a backend: it integrates a spacecraft; the core supplies valves, disturbances and sensors."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from fulmar_core.config.errors import SafetyError
from fulmar_core.dynamics.rigid_body import shifted
from fulmar_core.robots.basilisk_robots import check_basilisk
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.sensors.kind import Truth
from fulmar_core.robots.sensors.simulated import SimulatedSensors
from fulmar_core.simulation.backend import Sample
from fulmar_core.simulation.episode import Episode
from fulmar_core.states.attitude import Vector, cross, plus, scaled
from fulmar_core.states.spatial import SpatialState
from fulmar_core.states.state import RigidBodyState
from fulmar_core.tasks import Task
from fulmar_core.wires.reading import Reading
from fulmar_core.worlds.scenario import Scenario, sensors_in
from sim_nodes.basilisk_model import Answer, model_of, quat_of
from sim_nodes.basilisk_process import BasiliskCraft
from sim_nodes.one_world import OneWorld


class BasiliskBackend:
    """One spacecraft or satellite in Basilisk, without gravity; all of a process of ours share one of Basilisk."""

    def __init__(
        self, robot: Robot, *, sensor_noise: bool = True, sensors: Mapping[str, Any] | None = None
    ) -> None:
        """Start Basilisk.

        Args:
            robot: A spacecraft or satellite.
            sensor_noise: Whether sensors have noise.
            sensors: By name, in the place of those of the robot's file.

        Raises:
            ConfigError: The robot is none, or `.venv-peers` is missing.
            BasiliskError: Basilisk does not start.
        """
        check_basilisk(robot)
        self.robot = robot
        self._sensors = SimulatedSensors(sensors or robot.sensors.specs, noisy=sensor_noise)
        self._world = OneWorld(robot, noisy=sensor_noise)
        self._model = model_of(robot)
        self._craft = BasiliskCraft()
        self._answer: Answer = {}
        self._quat = np.array([0.0, 0.0, 0.0, 1.0])
        self._truth: RigidBodyState

    @classmethod
    def of(cls, robot: Robot, task: Task, scenario: Scenario) -> BasiliskBackend:
        """The simulator that a task and a scenario ask for; nothing touches the body, as in the core."""
        return cls(robot, sensor_noise=scenario.sensor_noise, sensors=sensors_in(robot, scenario))

    def reset(self, episode: Episode, *, seed: int, number: int = 0) -> Sample:
        """Begin anew; see `Backend.reset`."""
        self._sensors.reset(seed, number)
        self._world.begin_episode(episode)
        self._time_s = 0.0
        start = SpatialState.from_rigid(episode.start.to_rigid())
        center = shifted(start[None], self._com)
        self._quat = start.to_rigid().quat_xyzw
        world: Any = episode.world  # of a robot in space
        self._answer = self._craft.ask(begin=self._model.description(world, center))
        self._truth = self._read()
        return self._sample(self._world.first_measurement(self._truth, seed=seed, number=number))

    def step(self, command: np.ndarray, ticks: int = 1, *, begins: int | None = None) -> Sample:
        """Apply a command; see `Backend.step`.

        Raises:
            SafetyError: The state is not finite.
            BasiliskError: Basilisk does not answer.
        """
        world = self._world
        world.begin(np.asarray(command, dtype=float), ticks, self._truth, begins=begins)
        self._answer = self._model.drive(self._craft, world, ticks, self._answer)
        self._time_s += ticks * self.robot.timing.physics_dt
        self._truth = self._read()
        if not np.isfinite(self._truth.position_in_world).all():
            raise SafetyError(f"Basilisk's state is not finite at t = {self._time_s:.2f} s.")
        return self._sample(world.measure(self._truth))

    def stand(self, ticks: int = 1, *, begins: int | None = None) -> Sample:
        """Nothing holds a body in space; see `CanStand.stand`."""
        return self.step(np.array(self.robot.actuators.safe_command), ticks, begins=begins)

    def push(self, force: tuple[float, ...] | None) -> None:
        """See `CanPush.push`."""
        self._world.extra = force

    def make_safe(self) -> None:
        """Nothing to do: a command acts only during a step."""

    def close(self) -> None:
        """Remove the body; Basilisk's process ends with the last one."""
        self._craft.close()

    @property
    def _com(self) -> Vector:
        """Centre of mass in this episode, shapes (1,) [m]."""
        world: Any = self._world.world  # of a robot in space
        return self._model.center(world)

    def _read(self) -> RigidBodyState:
        """Motion of the body's origin."""
        answer, quat = self._answer, np.array(quat_of(self._answer))
        self._quat = quat if quat @ self._quat >= 0.0 else -quat
        columns = (*answer["position"], *self._quat, *answer["velocity"], *answer["rate"])
        center = SpatialState(*(np.array([part]) for part in columns))
        return shifted(center, scaled(-1.0, self._com))[0].to_rigid()

    def _felt(self) -> np.ndarray:
        """What an accelerometer at the body's origin measures, along the body's axes, shape (3,) [m/s²]."""
        answer, arm = self._answer, scaled(-1.0, self._com)
        rate, turning = ((x, y, z) for x, y, z in (answer["rate"], answer["turn_acceleration"]))
        moved = plus(cross(turning, arm), cross(rate, cross(rate, arm)))
        return np.array(
            [a + float(np.ravel(b)[0]) for a, b in zip(answer["acceleration"], moved, strict=True)]
        )

    def _sample(self, odometry: RigidBodyState) -> Sample:
        """All that sensors measure now."""
        truth = self._truth
        felt = Truth(truth, self._felt(), self._world.actuation.truths())
        return Sample({"odometry": Reading(odometry), **self._sensors.measure(felt, self._time_s)}, truth)
