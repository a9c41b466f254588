"""JSBSim behind the interface of backends: the flight of the batch, and what it refuses."""

from __future__ import annotations

import numpy as np
import pytest

from fulmar_core.disturbances.scenario import load_scenario
from fulmar_core.episode import draw_episode
from fulmar_core.errors import ConfigError
from fulmar_core.flight.trim import find_trim
from fulmar_core.robot import load_robot
from fulmar_core.tasks import load_task
from sim_nodes.jsbsim_backend import JsbsimBackend
from sim_nodes.mock_backend import MockBackend

ROBOT = load_robot("airship_v7")
TASK = load_task("fly_hold").fitted(ROBOT)
SURFACES = 0.01 * np.array([1.0, 1.0, 1.0, 0.0, 0.0])


@pytest.fixture
def episode():
    return draw_episode(ROBOT, TASK, load_scenario("ideal"), seed=4, number=0)


def test_two_seconds_of_steering_lead_where_our_own_dynamics_lead(episode):
    rng = np.random.default_rng(2)
    trim = find_trim(ROBOT, ROBOT.airframe.speed, 1.0).command
    ours, theirs = MockBackend(ROBOT, things=TASK.things), JsbsimBackend(ROBOT, sensor_noise=False)
    for backend in (ours, theirs):
        backend.reset(episode, seed=4)
    for _ in range(50):
        command = ROBOT.actuators.limited((trim + SURFACES * rng.standard_normal(5))[None])[0]
        one, other = ours.step(command, 4).truth, theirs.step(command, 4).truth
    theirs.close()
    np.testing.assert_allclose(other.position_in_world, one.position_in_world, rtol=0, atol=0.02)
    np.testing.assert_allclose(other.quat_xyzw, one.quat_xyzw, rtol=0, atol=2e-3)


def test_a_robot_that_does_not_fly_is_refused():
    with pytest.raises(ConfigError, match="no aircraft"):
        JsbsimBackend(load_robot("turtlebot2"))
