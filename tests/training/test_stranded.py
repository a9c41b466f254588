"""Worlds whose dead valves leave no pose to hold are asked for the place alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.disturbances.scenario import load_scenario
from fulmar_core.learning_step import learning_step
from fulmar_core.robot import load_robot
from fulmar_core.tasks import load_task
from training.stranded import Stranded
from training.vec_env import BatchVecEnv

ROBOT, TASK = load_robot("floating_platform"), load_task("drift_go_to_pose")
TWO_LOST = load_scenario("drift_two_lost")
# Numbers of valves from 0; a nozzle and the one that turns and pushes the opposite way, or two that turn alike.
STRANDED, ABLE = ((0, 5), (0, 2)), ((0, 1), (0, 7), (3,), ())


def alive(*lost):
    working = np.ones((8, len(lost)))
    for world, valves in enumerate(lost):
        working[list(valves), world] = 0.0
    return working


def test_only_what_leaves_no_pose_to_hold_counts_as_stranded():
    stranded = Stranded.of(ROBOT, TASK, TWO_LOST)
    assert stranded is not None
    np.testing.assert_array_equal(stranded.among(alive(*STRANDED, *ABLE)), [0, 1])
    assert len(stranded.codes) == 12  # of 28 pairs


@pytest.mark.parametrize(
    ("robot", "task"),
    [
        ("floating_platform", "go_to_pose"),
        ("floating_platform", "go_to_position"),
        ("turtlebot2", "go_to_pose"),
    ],
)
def test_tasks_that_ask_for_the_same_whatever_is_lost_have_none(robot, task):
    assert Stranded.of(load_robot(robot), load_task(task), TWO_LOST) is None


def test_robots_without_valves_are_never_stranded():
    assert Stranded.of(load_robot("turtlebot2"), TASK, TWO_LOST) is None


def test_stranded_worlds_are_rewarded_by_their_own_weights_and_others_as_always():
    worlds = BatchVecEnv(ROBOT, TASK, TWO_LOST, worlds=64, seed=3)
    worlds.reset()
    simulation = worlds.simulation
    before, goal, previous = simulation.truth, simulation.goal, simulation.command
    stranded = Stranded.of(ROBOT, TASK, TWO_LOST)
    assert stranded is not None
    which = stranded.among(simulation.world.alive)
    assert 0 < len(which) < 64
    rewards = worlds.step(np.zeros((64, 8), dtype=np.int8))[1]
    told = {
        "before": before, "after": simulation.truth, "goal": goal, "ended": simulation.goal, "previous": previous,
        "command": simulation.command,
    }  # fmt: skip
    expected = learning_step(ROBOT, TASK, **told)[0]
    their_own = replace(TASK, reward_weights=TASK.stranded_weights)
    expected[which] = learning_step(ROBOT, their_own, **told)[0][which]
    np.testing.assert_allclose(rewards, expected, rtol=1e-5)
