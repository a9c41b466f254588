"""What every robot's YAML promises."""

from __future__ import annotations

import json
from dataclasses import asdict

import numpy as np
import pytest

from fulmar_core.paths import config_names
from fulmar_core.robot import load_robot
from fulmar_core.safety.watchdog import default_timeout
from sim_nodes.mock_backend import MockBackend


@pytest.fixture(params=config_names("robots"))
def robot(request):
    return load_robot(request.param)


def test_it_has_a_title_and_actuators_with_names_of_their_own(robot):
    assert robot.title
    assert len(set(robot.actuators.names)) == len(robot.actuators.names) > 0


def test_its_nominal_body_lies_within_its_own_uncertainty(robot):
    low, high = robot.uncertainty.mass
    assert low <= robot.body.mass <= high
    low, high = robot.uncertainty.yaw_inertia
    assert low <= robot.body.inertia[2] <= high


def test_every_body_of_its_uncertainty_can_exist(robot):
    ixx, iyy, _ = robot.body.inertia
    assert robot.uncertainty.yaw_inertia[1] <= ixx + iyy


def test_its_safe_command_exerts_nothing_and_is_within_its_limits(robot):
    safe = robot.actuators.safe_command
    np.testing.assert_array_equal(robot.actuators.limited(safe), safe)
    force, torque = robot.actuators.wrench_in_body(safe)
    assert not force.any()
    assert not torque.any()


def test_its_actuators_reach_every_direction_of_the_plane(robot):
    wrench = robot.actuators.wrench_per_newton[:, [0, 1, 5]]
    assert np.linalg.matrix_rank(wrench) == 3


def test_its_nozzles_sit_on_the_body(robot):
    for nozzle in robot.actuators.nozzles:
        assert np.hypot(*nozzle.position[:2]) <= robot.body.radius + 1e-6


def test_commands_come_twice_before_the_watchdog_bites_or_at_least_once(robot):
    assert default_timeout(1.0 / robot.timing.control_hz) > 1.0 / robot.timing.control_hz


def test_full_thrust_for_a_second_stays_within_its_believable_limits(robot):
    force, torque = robot.actuators.wrench_in_body(np.eye(len(robot.actuators.names)))
    assert np.linalg.norm(force, axis=1).max() / robot.body.mass < robot.limits.speed
    assert np.abs(torque[:, 2]).max() / robot.uncertainty.yaw_inertia[0] < robot.limits.yaw_rate


def test_it_moves_in_the_mock(robot):
    backend = MockBackend(robot)
    sample = backend.step(np.eye(len(robot.actuators.names))[0], 10)
    assert np.linalg.norm(sample.truth.velocity_in_world) > 0.0


def test_it_compiles_in_mujoco(robot):
    pytest.importorskip("mujoco")
    from sim_nodes.mujoco_model import build_model

    assert build_model(robot).nu == len(robot.actuators.names)


def test_it_can_be_written_into_a_record(robot):
    json.dumps(asdict(robot), allow_nan=False)
