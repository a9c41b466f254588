"""Many worlds of one robot at one task, moved by the core's own dynamics in one batch."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from fulmar_core.disturbances.scenario import Scenario
from fulmar_core.dynamics.rigid_body import Disturbance, MassProperties, step
from fulmar_core.episode import NOISE, Episode, draw_episode, episode_rng
from fulmar_core.robot import Robot
from fulmar_core.rotation import Array
from fulmar_core.sensors.odometry import measure_odometry
from fulmar_core.state import Pose, RigidBodyState, planar_pose, planar_state
from fulmar_core.tasks import Task


class BatchSimulation:
    """Worlds that step together; each is reset by itself.

    Attributes:
        truth: True state, leading shape (worlds,).
        measured: What the odometry reports of it.
        goal: Goal of each world.
    """

    def __init__(
        self,
        robot: Robot,
        task: Task,
        scenario: Scenario,
        *,
        worlds: int,
        seed: int,
        control_hz: float | None = None,
        training: bool = False,
        dtype: Any = np.float32,
    ) -> None:
        """Build the worlds and reset them all.

        Args:
            robot: The robot.
            task: Says where episodes start.
            scenario: Says what may differ from world to world.
            worlds: Number of worlds, >= 1.
            seed: World w draws its episodes from (seed, w).
            control_hz: Command rate; the robot's own by default [Hz].
            training: Start episodes where learning starts.
            dtype: NumPy floating type of every array.
        """
        self.robot, self.task, self.scenario, self.seed = robot, task, scenario, seed
        self.worlds, self.training, self.dtype = worlds, training, dtype
        self.substeps = robot.timing.substeps(control_hz or robot.timing.control_hz)
        self._repeats = np.zeros(worlds, dtype=int)
        self._noise_rng = episode_rng(seed, 0, stream=NOISE)
        zeros = np.zeros(worlds)
        self.truth: RigidBodyState = planar_state(zeros, zeros, zeros).astype(dtype)
        self.goal: Pose = planar_pose(zeros, zeros, zeros).astype(dtype)
        self._body = MassProperties(np.ones((worlds, 1), dtype=dtype), np.ones((worlds, 3), dtype=dtype))
        self._disturbance = Disturbance(
            np.zeros((worlds, 3), dtype=dtype), np.zeros((worlds, 3), dtype=dtype)
        )
        self.reset(range(worlds))

    @property
    def control_dt(self) -> float:
        """Time of one control step [s]."""
        return self.substeps * self.robot.timing.physics_dt

    def reset(self, worlds: Sequence[int] | np.ndarray | range) -> None:
        """Begin a new episode in some worlds.

        Args:
            worlds: Numbers of the worlds.
        """
        for world in worlds:
            episode = draw_episode(
                self.robot,
                self.task,
                self.scenario,
                seed=self.seed,
                number=int(world),
                repeat=int(self._repeats[world]),
                training=self.training,
            )
            self._repeats[world] += 1
            self._place(int(world), episode)
        self._measure()

    def _place(self, world: int, episode: Episode) -> None:
        self.truth.write(world, episode.start)
        self.goal.write(world, episode.goal)
        self._body.mass[world] = episode.world.mass
        self._body.inertia[world] = episode.world.inertia
        self._disturbance.force_in_world[world] = episode.world.force_in_world
        self._disturbance.torque_in_world[world] = episode.world.torque_in_world

    def step(self, command: Array) -> None:
        """Apply one command for one control step.

        Args:
            command: Within the actuators' limits, shape (worlds, n).
        """
        force, torque = self.robot.actuators.wrench_in_body(np.asarray(command, dtype=self.dtype))
        self.truth = step(
            self.truth,
            force,
            torque,
            body=self._body,
            disturbance=self._disturbance,
            planar=self.robot.body.planar,
            dt=self.robot.timing.physics_dt,
            substeps=self.substeps,
        )
        self._measure()

    def _measure(self) -> None:
        self.measured = (
            measure_odometry(self.truth, self.robot.sensors.odometry, self._noise_rng)
            if self.scenario.sensor_noise
            else self.truth
        )
