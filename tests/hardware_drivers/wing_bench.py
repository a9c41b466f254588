"""A fixed wing that flies the core's dynamics by the clock behind an emulated autopilot."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from fulmar_core.dynamics.flight_trim import find_trim, flying_at
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.sensors.imu import ImuSample
from fulmar_core.simulation.backend import Sample
from fulmar_core.simulation.episode import Episode, draw_episode
from fulmar_core.states.spatial import SpatialState
from fulmar_core.tasks import load_task
from fulmar_core.wires.reading import Reading
from fulmar_core.worlds.scenario import load_scenario
from sim_nodes.emulators.device import EmulatedDevice
from sim_nodes.mock_backend import MockBackend

ROBOT = load_robot("volantex_ranger")
HEIGHT = 40.0
START = (30.0, -20.0, HEIGHT, 0.0, 0.0, 70.0)  # m, deg: nose a little east of north


def episode_at(start: tuple[float, ...] = START) -> Episode:
    """A still world with an aircraft in trim."""
    task = load_task("fly_hold").fitted(ROBOT)
    drawn = draw_episode(ROBOT, task, load_scenario("ideal"), seed=1, number=0)
    return replace(drawn, start=flying_at(ROBOT, np.asarray(SpatialState.target_at(start))))


def trim() -> np.ndarray:
    """The command of level flight."""
    return np.asarray(find_trim(ROBOT, ROBOT.airframe.speed).command)


class WingBench:
    """Steps an emulated autopilot and its wing in real time, in a thread of its own."""

    def __init__(self, device: EmulatedDevice) -> None:
        self.backend = MockBackend(ROBOT)
        self.sample = self.backend.reset(episode_at(), seed=1)
        self.device, self.command = device, trim()
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _run(self) -> None:
        dt, due = ROBOT.timing.physics_dt, time.monotonic()
        while not self._over.wait(max(0.0, due - time.monotonic())):
            self.command = self.device.command(time.monotonic())
            sample = self.backend.step(self.command)
            imu = ImuSample(np.array([0.0, 0.0, 9.80665]), sample.truth.angular_velocity_in_body)
            self.sample = Sample({**sample.readings, "imu": Reading(imu)}, sample.truth)
            self.device.report(self.sample, time.monotonic())
            due = max(due + dt, time.monotonic() - 0.1)

    @property
    def height(self) -> float:
        return float(self.sample.truth.position_in_world[2])

    def stop(self) -> None:
        self._over.set()
        self._thread.join()
        self.device.close()


def until(condition: Callable[[], bool], timeout_s: float = 5.0) -> None:
    """Wait for something."""
    end = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < end, "it did not happen in time"
        time.sleep(0.005)
