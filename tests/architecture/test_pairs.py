"""The subset of robot and task pairs for quick tests."""

from __future__ import annotations

import itertools

import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks import load_task
from tests.pairs import covering
from tests.spaces import shared_space


def test_a_covering_subset_has_every_robot_and_every_task():
    chosen = covering(itertools.product("abc", range(7)))
    assert {robot for robot, _ in chosen} == set("abc")
    assert {task for _, task in chosen} == set(range(7))
    assert len(chosen) == 7


def test_a_robot_is_included_even_if_all_its_tasks_are_taken():
    assert covering([("a", 1), ("b", 1), ("c", 2)]) == {("a", 1), ("b", 1), ("c", 2)}


def test_robots_meet_the_tasks_of_their_space_alone():
    robots = {name: load_robot(name) for name in ("turtlebot2", "spacecraft_16")}
    tasks = {name: load_task(name) for name in ("go_to_pose", "go_to_pose_3d", "push_block")}
    assert shared_space(robots, tasks) == [
        ("turtlebot2", "go_to_pose"),
        ("turtlebot2", "push_block"),
        ("spacecraft_16", "go_to_pose_3d"),
    ]
    for robot, task in itertools.product(robots, tasks):
        if (robot, task) in shared_space(robots, tasks):
            tasks[task].check(robots[robot])
        else:
            with pytest.raises(ConfigError):
                tasks[task].check(robots[robot])
