"""JSBSim behind the interface of backends: the flight of the batch, and what it refuses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.dynamics.flight_trim import find_trim, flying_at
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.episode import draw_episode
from fulmar_core.states.spatial import SpatialState
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario
from sim_nodes.jsbsim_backend import JsbsimBackend
from sim_nodes.mock_backend import MockBackend

ROBOT = load_robot("airship_v7")
TASK = load_task("fly_hold").fitted(ROBOT)


def at_height(height):
    return flying_at(ROBOT, np.asarray(SpatialState.target_at((0.0, 0.0, height))))


@pytest.fixture
def episode():
    return draw_episode(ROBOT, TASK, load_scenario("ideal"), seed=4, number=0)


def flown(episode, *, spread, commands):
    """True motion by our dynamics and by JSBSim after control steps about trim, all five actuators moving."""
    rng = np.random.default_rng(2)
    trim = find_trim(ROBOT, ROBOT.airframe.speed, float(episode.start.z)).command
    sent = [ROBOT.actuators.limited(trim + spread * rng.standard_normal(5)) for _ in range(commands)]
    backends = MockBackend(ROBOT, things=TASK.things), JsbsimBackend(ROBOT, sensor_noise=False)
    ends = []
    for backend in backends:
        backend.reset(episode, seed=4)
        ends.append([backend.step(command, 4).truth for command in sent][-1])
        backend.close()
    return ends


def test_two_seconds_of_steering_lead_where_our_own_dynamics_lead(episode):
    ours, theirs = flown(replace(episode, start=at_height(5.0)), spread=0.01, commands=50)
    assert ours.position_in_world[2] > 1.0  # it has not touched the water
    np.testing.assert_allclose(theirs.position_in_world, ours.position_in_world, rtol=0, atol=0.02)
    np.testing.assert_allclose(theirs.quat_xyzw, ours.quat_xyzw, rtol=0, atol=2e-3)


def test_a_craft_that_touches_the_water_stays_there_at_rest(episode):
    low = replace(at_height(0.6), vz=np.asarray(-2.0))
    _, theirs = flown(replace(episode, start=low), spread=0.0, commands=25)
    assert 0.0 < theirs.position_in_world[2] + ROBOT.hull_span[0] < 0.05
    assert not theirs.velocity_in_world.any()
    assert not theirs.angular_velocity_in_body.any()


def test_a_robot_that_does_not_fly_is_refused():
    with pytest.raises(ConfigError, match="no aircraft"):
        JsbsimBackend(load_robot("turtlebot2"))
