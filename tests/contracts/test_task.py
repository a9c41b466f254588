"""What every task promises."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import get_args

import numpy as np
import pytest

from fulmar_core.paths import config_names
from fulmar_core.robot import load_robot
from fulmar_core.state import planar_pose, planar_state
from fulmar_core.tasks import Task, load_task
from fulmar_core.tasks.planar import planar_error
from fulmar_core.topics import GOAL_WIRES

ROBOT = load_robot("floating_platform")


@pytest.fixture(params=config_names("tasks"))
def task(request):
    return load_task(request.param)


def batch(count=50):
    rng = np.random.default_rng(2)
    state = planar_state(
        *rng.uniform(-3, 3, (3, count)), vx=rng.normal(size=count), yaw_rate=rng.normal(size=count)
    )
    return state, planar_pose(*rng.uniform(-3, 3, (3, count)))


def test_every_kind_of_task_has_a_file():
    assert {type(load_task(name)) for name in config_names("tasks")} == set(get_args(Task))


def test_observations_are_finite_and_as_wide_as_their_names(task):
    seen = task.observe(*batch())
    assert seen.shape == (50, len(task.observation_names))
    assert np.isfinite(seen).all()


def test_at_the_goal_itself_everything_is_finite(task):
    state, goal = planar_state(1.0, 2.0, 0.3), planar_pose(1.0, 2.0, 0.3)
    assert np.isfinite(task.observe(state, goal)).all()
    assert np.isfinite(task.reward(state, state, goal, np.zeros(8)))


def test_a_batch_is_observed_and_rewarded_like_its_members(task):
    state, goal = batch()
    command = (np.random.default_rng(3).uniform(size=(50, 8)) > 0.5).astype(float)
    seen, reward = task.observe(state, goal), task.reward(state, state, goal, command)
    assert reward.shape == (50,)
    for i in range(50):
        one = type(goal)(goal.position_in_world[i], goal.quat_xyzw[i])
        np.testing.assert_allclose(task.observe(state[i], one), seen[i], rtol=0, atol=1e-12)
        assert task.reward(state[i], state[i], one, command[i]) == pytest.approx(reward[i], abs=1e-12)


def test_the_floating_type_is_kept(task):
    state, goal = batch()
    state, goal = state.astype(np.float32), goal.astype(np.float32)
    assert task.observe(state, goal).dtype == np.float32
    assert task.reward(state, state, goal, np.zeros((50, 8), np.float32)).dtype == np.float32


def test_resting_at_the_goal_is_worth_more_than_resting_anywhere_else(task):
    state, goal = batch()
    home = planar_state(
        *goal.position_in_world[:, :2].T, np.arctan2(goal.quat_xyzw[:, 2], goal.quat_xyzw[:, 3]) * 2
    )
    nothing = np.zeros((50, 8))
    assert (task.reward(home, home, goal, nothing) > task.reward(state, state, goal, nothing)).all()


def test_starts_lie_within_the_geofence_of_the_platform(task):
    for training in (False, True):
        for seed in range(50):
            start, goal = task.start.draw(np.random.default_rng(seed), training=training)
            assert planar_error(start, goal).position < ROBOT.limits.geofence


def test_its_closing_window_fits_into_its_episode(task):
    assert task.tolerance.hold_s < task.episode_s


def test_its_goal_arrives_on_a_wire(task):
    assert task.goal_topic in GOAL_WIRES


def test_it_can_be_written_into_a_record(task):
    json.dumps(asdict(task), allow_nan=False)
