"""An emulated device on the bench: its physics is the core's own, its time that of the wall."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

import numpy as np

from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.sensors.imu import ImuSample
from fulmar_core.simulation.backend import Sample
from fulmar_core.simulation.episode import Episode, draw_episode
from fulmar_core.states.planar import at_rest
from fulmar_core.states.spatial import SpatialState
from fulmar_core.tasks import load_task
from fulmar_core.wires.reading import Reading
from fulmar_core.worlds.scenario import load_scenario
from sim_nodes.emulators.device import EmulatedDevice
from sim_nodes.mock_backend import MockBackend


def episode_at(robot: Robot, x: float, y: float, heading: float) -> Episode:
    """A still world with a robot at rest."""
    in_space = robot.state_type is SpatialState
    task = load_task("go_to_position_3d" if in_space else "go_to_position")
    drawn = draw_episode(robot, task, load_scenario("ideal"), seed=1, number=0)
    start = at_rest(*(np.asarray(value) for value in (x, y, heading)))
    if in_space:
        return Episode(SpatialState.from_rigid(start.to_rigid()), drawn.goal, drawn.world)
    return Episode(start, drawn.goal, drawn.world)


class Bench:
    """Steps device and physics in real time, in a thread of its own."""

    def __init__(
        self,
        robot: str,
        make: Callable[[MockBackend], EmulatedDevice],
        *,
        start=(0.0, 0.0, 0.0),
        each_tick=lambda: None,
    ) -> None:
        self.robot = load_robot(robot)
        self.backend = MockBackend(self.robot)
        self.sample = self.backend.reset(episode_at(self.robot, *start), seed=1)
        self.device = make(self.backend)
        self.command = self.robot.actuators.safe_command
        self._each_tick = each_tick
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _run(self) -> None:
        dt = self.robot.timing.physics_dt
        began, ticks = time.monotonic(), 0
        while not self._over.wait(0.004):
            while ticks < (time.monotonic() - began) / dt:
                self.command = self.device.command(time.monotonic())
                sample = self.backend.step(self.command)
                self._each_tick()
                imu = ImuSample(np.array([0.0, 0.0, 9.80665]), sample.truth.angular_velocity_in_body)
                readings = {"odometry": Reading(sample.truth), "imu": Reading(imu)}
                self.sample = Sample(readings, sample.truth)
                self.device.report(self.sample, time.monotonic())
                ticks += 1

    def stop(self) -> None:
        self._over.set()
        self._thread.join()
        self.device.close()


def until(condition: Callable[[], bool], timeout_s: float = 10.0) -> None:
    """Wait for something."""
    end = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < end, "it did not happen in time"
        time.sleep(0.005)
