"""Robots whose dead valves leave no pose to hold are asked for the place above all."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario
from training.vec_env import BatchVecEnv
from training.worlds import training_task

ROBOT, TASK = load_robot("floating_platform"), load_task("drift_go_to_pose")
UNCONTROLLABLE = load_scenario("drift_uncontrollable")


def rewards(task, scenario):
    worlds = BatchVecEnv(ROBOT, task, scenario, worlds=16, seed=3)
    worlds.reset()
    return worlds.step(np.zeros((16, 8), dtype=np.int8))[1]


def test_uncontrollable_robots_are_rewarded_by_their_own_weights():
    plain_task = replace(TASK, stranded_weights=None)  # word: YAML key of tasks
    meant = replace(plain_task, reward_weights=TASK.stranded_weights)  # word: YAML key of tasks
    np.testing.assert_array_equal(rewards(TASK, UNCONTROLLABLE), rewards(meant, UNCONTROLLABLE))
    plain = rewards(plain_task, UNCONTROLLABLE)
    assert np.abs(plain - rewards(meant, UNCONTROLLABLE)).max() > 0.1


@pytest.mark.parametrize(
    ("task", "scenario"),
    [
        ("drift_go_to_pose", "drift_two_lost"),
        ("go_to_pose", "drift_uncontrollable"),
        ("go_to_position", "drift_uncontrollable"),
    ],
)
def test_other_tasks_and_scenarios_keep_their_weights(task, scenario):
    plain = load_task(task)
    assert training_task(plain, load_scenario(scenario)) is plain
