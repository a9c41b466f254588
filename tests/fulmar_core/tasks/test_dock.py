"""The task `dock`: starts before the port, an observation that says nothing of the goal, and what it refuses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.controllers.classical import load_classical
from fulmar_core.loop.rollout import batches, roll_out_in_batch
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.episode import draw_episodes
from fulmar_core.simulation.metrics import summary
from fulmar_core.tasks import load_task
from fulmar_core.tasks.observation import Observer
from fulmar_core.tasks.space_terms import MOTION_TERMS
from fulmar_core.worlds.scenario import load_scenario

ROBOT, TASK = load_robot("cubesat_8"), load_task("dock")


def drawn(count=500):
    return draw_episodes(ROBOT, TASK, load_scenario("ideal"), seed=1, numbers=np.arange(count))


def test_starts_lie_before_the_port_and_look_at_it():
    start, goal = drawn().start, drawn().goal
    berth = np.array(TASK.berth)
    np.testing.assert_allclose(goal.current, np.tile(berth, (500, 1)))
    ahead = np.asarray(start.x) - berth[0]
    assert 1.2 <= ahead.min() < 1.25
    assert 2.95 < ahead.max() <= 3.0
    assert np.abs(start.y).max() <= 0.6
    errors = TASK.errors(start, goal)
    assert np.rad2deg(errors.attitude).max() < np.sqrt(3.0) * 17.1
    assert np.rad2deg(errors.attitude).max() > 17.0


def test_the_observation_says_nothing_of_the_goal():
    assert Observer(ROBOT, TASK).names == MOTION_TERMS
    start, goal = drawn(3).start, drawn(3).goal
    np.testing.assert_array_equal(np.stack(TASK.observe(start, goal)), np.zeros((6, 3)))


def test_its_structure_is_in_the_world_and_nothing_keeps_the_robot_away_from_it():
    assert [structure.name for structure in TASK.structures] == ["gateway"]
    assert TASK.keep_outs == ()
    assert TASK.collides(drawn(3).start, drawn(3).goal, ROBOT) is None


def test_the_pd_law_docks_on_the_goal_that_it_is_given():
    law = load_classical(ROBOT, TASK, law="pd")
    near = replace(TASK, episode_s=12.0, start=replace(TASK.start, behind=(0.2, 0.6), aside=0.2))
    flights = roll_out_in_batch(law, ROBOT, near, load_scenario("nominal"), episodes=3, seed=5)
    assert summary(flights, near)["success_rate"] == 1.0


def test_a_controller_that_sees_is_refused_where_there_is_no_camera():
    class Seeing:
        name, control_hz, readings = "policy", 10.0, ("camera_depth",)

    words = "controller 'policy' takes the reading 'camera_depth', and there is no camera here. .*--through mujoco"
    with pytest.raises(ConfigError, match=words):
        next(batches(Seeing(), ROBOT, TASK, load_scenario("ideal"), episodes=1, seed=1))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"thing": ""}, "'thing' is missing"),
        ({"berth": (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 2.0)}, "'berth' must be"),
    ],
)
def test_what_is_no_berth_is_refused(changes, words):
    with pytest.raises(ValueError, match=words):
        replace(TASK, **changes)


def test_a_start_behind_its_own_berth_is_refused():
    with pytest.raises(ValueError, match="'behind' must be"):
        replace(TASK.start, behind=(2.0, 1.0))


def test_a_goal_other_than_the_berth_and_another_thing_are_refused_in_one_line():
    berth = np.array(TASK.berth)
    assert not TASK.goal_problem(berth[None])
    assert "from the berth of 'dock'" in TASK.goal_problem(np.zeros((1, 7)))
    with pytest.raises(ConfigError, match="has a berth at 'gateway', not at 'iss'"):
        load_task("dock", "iss")
