"""Every simulator of aircraft measures where surfaces and motors stand, and not what was commanded."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.dynamics.flight_trim import find_trim
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.sensors.kind import Truth
from fulmar_core.robots.sensors.simulated import SimulatedSensors
from fulmar_core.robots.sensors.surfaces import SurfacePositions, SurfacesSpec
from fulmar_core.simulation.episode import draw_episode
from fulmar_core.states.state import RigidBodyState
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario
from sim_nodes.jsbsim_backend import JsbsimBackend
from sim_nodes.mock_backend import MockBackend
from sim_nodes.mujoco_backend import MujocoBackend

ROBOT = load_robot("airship_v7")
TASK = load_task("fly_hold").fitted(ROBOT)
EXACT = replace(load_scenario("ideal"), sensor_noise=False)
BACKENDS = {
    "mock": lambda: MockBackend(ROBOT),
    "mujoco": lambda: MujocoBackend.of(ROBOT, TASK, EXACT),
    "jsbsim": lambda: JsbsimBackend(ROBOT, sensor_noise=False),
}


@pytest.mark.parametrize("name", BACKENDS)
def test_a_surface_follows_a_step_as_its_servo_does(name):
    backend = BACKENDS[name]()
    episode = draw_episode(ROBOT, TASK, EXACT, seed=4, number=0)
    began = episode.command
    backend.reset(episode, seed=4)
    command = find_trim(ROBOT, 28.0, 1.0).command + np.array([0.05, 0.0, 0.0, 0.0, 0.0])
    found = [backend.step(command).readings["surfaces"].value for _ in range(30)]
    backend.close()
    assert found[0].names == ROBOT.actuators.names
    rate, damping = ROBOT.actuators.servo_rate, ROBOT.actuators.servo_damping
    swing = rate * math.sqrt(1.0 - damping**2)
    t = 0.01 * np.arange(1, 31)
    decay = np.exp(-damping * rate * t)
    answer = 1.0 - decay * (np.cos(swing * t) + damping * rate / swing * np.sin(swing * t))
    elevator = began[0] + (command[0] - began[0]) * answer
    np.testing.assert_allclose([each.positions[0] for each in found], elevator, rtol=0, atol=1e-9)
    throttle = began[3] + (command[3] - began[3]) * (1.0 - np.exp(-t / 0.2))
    np.testing.assert_allclose([each.positions[3] for each in found], throttle, rtol=0, atol=1e-9)


def test_only_deflections_have_noise_and_steps():
    true = SurfacePositions(("elevator", "throttle"), np.array([0.1, 0.4]))
    still = RigidBodyState(np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]), np.zeros(3), np.zeros(3))
    sensors = SimulatedSensors({"surfaces": SurfacesSpec(std=0.02, quantum=0.01)}, noisy=True)
    sensors.reset(1, 0)
    seen = np.array(
        [
            sensors.measure(Truth(still, more={"surfaces": true}), 0.01 * k)["surfaces"].value.positions
            for k in range(400)
        ]
    )
    assert np.std(seen[:, 0]) == pytest.approx(0.02, rel=0.15)
    np.testing.assert_allclose(seen[:, 0], 0.01 * np.round(seen[:, 0] / 0.01), atol=1e-12)
    assert (seen[:, 1] == 0.4).all()


def test_a_robot_without_surfaces_reports_none():
    sensors = SimulatedSensors({"surfaces": SurfacesSpec()}, noisy=True)
    sensors.reset(1, 0)
    still = RigidBodyState(np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]), np.zeros(3), np.zeros(3))
    assert sensors.measure(Truth(still), 0.0) == {}


def test_its_covariance_is_that_of_deflections_alone_and_its_rate_that_of_the_file():
    true = SurfacePositions(("elevator", "throttle"), np.array([0.1, 0.4]))
    still = RigidBodyState(np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]), np.zeros(3), np.zeros(3))
    sensors = SimulatedSensors({"surfaces": SurfacesSpec(std=0.02, quantum=0.01, rate_hz=50.0)}, noisy=True)
    sensors.reset(1, 0)
    seen = [
        sensors.measure(Truth(still, more={"surfaces": true}), 0.01 * k).get("surfaces") for k in range(100)
    ]
    found = [each for each in seen if each is not None]
    assert len(found) == 50
    np.testing.assert_allclose(found[0].covariance, np.diag([0.02**2 + 0.01**2 / 12.0, 0.0]))
