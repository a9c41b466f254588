"""What is estimated of motion, pushes and dead valves, in the body's own frame."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.controllers.body_frame import BodyFrame
from fulmar_core.estimators.actuator_health.actuator_estimator import ActuatorEstimator
from fulmar_core.estimators.actuator_health.filters import HealthSettings
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.states.planar import PlanarState
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario
from tests.inputs import inputs_of

ROBOT, WORLDS = load_robot("floating_platform"), 16
WITHOUT_TRIALS = HealthSettings(retry_s=0.0)


def estimated(scenario, *, task="drift_go_to_pose", steps=40):
    """Robots whose pairs of valves open at random: situations with and without the estimate, it, the simulation."""
    task = load_task(task)
    simulation = BatchSimulation(ROBOT, task, load_scenario(scenario), worlds=WORLDS, seed=4)
    estimator = ActuatorEstimator(ROBOT, WITHOUT_TRIALS)
    rng = np.random.default_rng(2)
    estimate = estimator.update(simulation.measured, None, simulation.control_dt)
    for _ in range(steps):
        command = (np.argsort(rng.random((WORLDS, 8)), axis=1) < 2).astype(float)
        simulation.step(command)
        estimate = estimator.update(simulation.measured, command, simulation.control_dt)
    frame, raw = BodyFrame(ROBOT, task), inputs_of(simulation)
    return frame.body_state(replace(raw, estimates=estimate)), frame.body_state(raw), simulation


def in_body(simulation, x, y):
    c, s = np.cos(simulation.truth.yaw), np.sin(simulation.truth.yaw)
    return c * x + s * y, c * y - s * x


def test_a_force_is_found_in_the_bodys_frame():
    now, raw, simulation = estimated("drift_force_2", steps=80)
    ahead, left = in_body(simulation, simulation.world.force_x, simulation.world.force_y)
    np.testing.assert_allclose(now.push[:, 0], ahead, atol=0.1)
    np.testing.assert_allclose(now.push[:, 1], left, atol=0.1)
    assert not raw.push.any()


def test_velocities_are_known_better_than_they_are_measured():
    now, raw, simulation = estimated("drift_velocity_noise_4")
    ahead, _ = in_body(simulation, simulation.truth.vx, simulation.truth.vy)
    assert np.std(now.motion[0] - ahead) < 0.6 * np.std(raw.motion[0] - ahead)
    np.testing.assert_allclose(now.goal[0], raw.goal[0], atol=0.01)


def test_dead_valves_are_known():
    now, raw, simulation = estimated("drift_two_lost")
    np.testing.assert_array_equal(now.alive, simulation.world.alive.T)
    assert raw.alive is None


def test_another_number_of_robots_begins_anew():
    rng = np.random.default_rng(1)
    many, one = PlanarState(*rng.normal(size=(6, 3))), PlanarState(*rng.normal(size=(6, 1)))
    estimator = ActuatorEstimator(ROBOT, WITHOUT_TRIALS)
    for _ in range(2):
        estimator.update(many, np.ones((3, 8)), 0.2)
    estimate = estimator.update(one, np.ones((1, 8)), 0.2)
    np.testing.assert_array_equal(estimate.state.x, one.x)
    assert estimate.push.tolist() == [[0.0, 0.0, 0.0]]


def test_a_robot_without_valves_has_no_estimator():
    with pytest.raises(ConfigError, match="'kingfisher'"):
        ActuatorEstimator(load_robot("kingfisher"), HealthSettings())
