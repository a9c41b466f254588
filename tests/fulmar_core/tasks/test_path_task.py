"""Path following as a task: goals as the goal node publishes them, and errors."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from fulmar_core.robots.robot_file import load_robot
from fulmar_core.states.counter_rng import START, Draws
from fulmar_core.states.planar import PlanarState
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal_files import load_goals
from fulmar_core.tasks.goal_sequence import Following
from fulmar_core.tasks.path_task import path_task

PLATFORM = load_robot("floating_platform")
TRACK = load_task("track_velocities")
PATHS = ("drift_circle", "drift_infinite", "drift_square")


def drawn(task, worlds=6):
    numbers = np.arange(worlds)
    return task.draw(Draws(7, numbers, np.zeros_like(numbers), START), PLATFORM, training=False)


@pytest.mark.parametrize("goals", PATHS)
def test_many_robots_get_the_goals_that_the_goal_node_publishes_to_each(goals):
    file = load_goals(goals)
    task = path_task(TRACK, file)
    rng = np.random.default_rng(3)
    state, goal = drawn(task)
    nodes = [Following(file, sideways=True) for _ in range(len(state.x))]
    for step in range(150):
        for world, node in enumerate(nodes):
            target = node.step(state[world], 0.2 * step).current
            np.testing.assert_allclose(goal.current[world], target, atol=1e-12)
        speed = goal.current[:, :2]
        c, s = np.cos(state.yaw), np.sin(state.yaw)
        vx = c * speed[:, 0] - s * speed[:, 1] + rng.normal(0.0, 0.01, len(c))
        vy = s * speed[:, 0] + c * speed[:, 1] + rng.normal(0.0, 0.01, len(c))
        state = PlanarState(state.x + 0.2 * vx, state.y + 0.2 * vy, state.yaw + 0.01, vx, vy, 0.05 + 0.0 * vx)
        goal = task.advance(goal, state, np.full(len(c), 0.2 * step))


def test_starts_lie_on_the_path_and_differ():
    task = path_task(TRACK, load_goals("drift_square"))
    state, _ = drawn(task, worlds=40)
    assert np.max(task.off_path(state.x, state.y)) == 0.0
    assert len({(float(x), float(y)) for x, y in zip(state.x, state.y, strict=True)}) > 30
    assert not np.any(state.speed)


def test_errors_count_against_the_velocity_that_is_wanted_here_not_the_one_published_ahead():
    task = path_task(TRACK, load_goals("drift_circle"))
    assert task.lead_s > 0.0
    state, goal = drawn(task, worlds=1)
    moving = dataclasses.replace(state, vx=np.array([0.1]), vy=np.array([0.1]))
    now = np.zeros(1)
    ahead, here = (one.advance(goal, moving, now).current for one in (task, task.evaluated))
    still = task.advance(goal, state, now).current
    assert np.abs(ahead - here).max() > 0.005
    np.testing.assert_array_equal(here, still)


def test_distance_is_to_the_nearest_point_of_the_whole_path():
    task = path_task(TRACK, load_goals("drift_circle"))
    np.testing.assert_allclose(
        task.off_path(np.array([0.0, 1.5, 2.0]), np.zeros(3)), (1.5, 0.0, 0.5), atol=2e-3
    )


@pytest.mark.parametrize("changes", [{"loops": 2}, {"closed": False}])
def test_a_path_that_ends_is_refused(changes):
    task = path_task(TRACK, load_goals("drift_circle"))
    with pytest.raises(ValueError, match="closed"):
        dataclasses.replace(task, path=dataclasses.replace(task.path, **changes))
