"""A path through waypoints in three dimensions: its shape, what it refuses, and that LQI follows it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.controllers.classical import gains_of, load_classical
from fulmar_core.controllers.flight_lqi import FlightLqi
from fulmar_core.loop.rollout import roll_out_in_batch
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.metrics import successes
from fulmar_core.states.counter_rng import Draws
from fulmar_core.tasks import load_task
from fulmar_core.tasks.references.flight_paths import through
from fulmar_core.worlds.scenario import Scenario, load_scenario

ROBOT = load_robot("airship_v7")
TASK = load_task("fly_path")


def test_a_path_meets_its_waypoints_and_overshoots_none():
    side, above = through(TASK.waypoints, 28.0)
    places = np.array(TASK.waypoints)
    times = places[:, 0] / 28.0
    np.testing.assert_allclose(side(times), places[:, 1], atol=1e-12)
    np.testing.assert_allclose(above(times), places[:, 2], atol=1e-12)
    dense = np.linspace(-5.0, 90.0, 3000)
    assert above(dense).min() == pytest.approx(1.0)
    assert above(dense).max() == pytest.approx(12.0, abs=1e-3)
    assert (side(np.array([80.0, 90.0])) == 4.0).all(), "straight ahead beyond the last one"


def test_the_goal_has_the_path_at_the_craft_s_own_speed():
    _, goal = TASK.fitted(ROBOT).draw(Draws(1, np.arange(2), np.zeros(2)), ROBOT, training=False)
    at = np.argmin(np.abs(goal.targets[0, :, 0] - 500.0))
    np.testing.assert_allclose(goal.targets[0, at, 1:3], [8.0, 8.0], atol=0.05)


def test_going_to_the_side_as_fast_as_a_ramp_does_is_rewarded_where_the_task_weighs_it():
    task = load_task("fly_c").fitted(ROBOT)
    state, goal = task.draw(Draws(1, np.arange(1), np.zeros(1)), ROBOT, training=False)
    goal = task.advance(goal, state, np.array([5.0]))  # on the first ramp, which goes 1 m/s to the left
    along, astray = (replace(state, vy=state.vy + drift) for drift in (1.0, -1.0))

    def gain(weighed):
        return weighed.reward(state, along, goal, goal) - weighed.reward(state, astray, goal, goal)

    unweighed = replace(task, reward_weights=replace(task.reward_weights, drift=0.0))
    assert abs(float(gain(unweighed)[0])) < 0.01
    assert float(gain(task)[0]) > 1.0


@pytest.mark.slow
def test_lqi_follows_the_first_climb_and_turn():
    task = replace(TASK, episode_s=12.0)
    law = FlightLqi(ROBOT, task, replace(gains_of(ROBOT, "lqi"), observer=None))
    exact = Scenario("exact", sensor_noise=False, body="nominal")
    run = roll_out_in_batch(law, ROBOT, task, exact, episodes=1, seed=1)
    assert np.ptp(run.z) > 1.0
    assert np.ptp(run.y) > 1.0
    assert run.position_error.max() < 0.1


@pytest.mark.slow
def test_lqi_follows_the_whole_path_with_noise():
    run = roll_out_in_batch(
        load_classical(ROBOT, TASK), ROBOT, TASK, load_scenario("nominal"), episodes=16, seed=1
    )
    assert successes(run, TASK).mean() >= 0.9


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"waypoints": ()}, "'waypoints' go with"),
        ({"reference": "a"}, "'waypoints' go with"),
        ({"waypoints": ((0.0, 0.0, 1.0), (0.0, 1.0, 1.0))}, "further ahead than the one before"),
    ],
)
def test_a_path_that_cannot_be_is_refused(change, says):
    with pytest.raises(ValueError, match=says):
        replace(TASK, **change)


def test_a_start_in_the_water_before_a_path_is_refused():
    low = replace(TASK, start=replace(TASK.start, height=(0.3 - TASK.waypoints[0][2], 0.0)))
    with pytest.raises(ConfigError, match="starts at"):
        low.check(ROBOT)


def test_a_path_into_the_water_is_refused():
    with pytest.raises(ConfigError, match=r"leads down to 0\.1 m, where the hull of 'airship_v7' touches"):
        replace(TASK, waypoints=((0.0, 0.0, 2.0), (100.0, 0.0, 0.1))).check(ROBOT)
