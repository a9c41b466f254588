"""What a control step is worth to a learner, and whether it ends an episode."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.config.paths import config_names
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.learning_step import learning_step
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.states.planar import at_rest
from fulmar_core.states.state import State
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal import Goal
from fulmar_core.worlds.scenario import load_scenario
from tests.spaces import robot_for

BASE = load_robot("turtlebot2")
POSITION, PUSH = load_task("go_to_position"), load_task("push_block")
OBSTACLES, VELOCITIES = load_task("go_to_position_with_obstacles"), load_task("track_velocities")
STILL = np.zeros((1, 2))


def place(x):
    return at_rest(np.array([float(x)]), np.zeros(1), np.zeros(1))


def goal_at(x=0.0, *, disc=None, block=(0.0, 0.0)):
    discs = np.zeros((1, 0, 3)) if disc is None else np.array([[disc]])
    return Goal(np.array([[[x, 0.0, 0.0]]]), np.zeros(1), discs, {"block": np.array([[*block, 0.0]])})


def evaluated(task, here, *, before=None, goal=None, ended=None, previous=STILL, command=STILL, robot=BASE):
    goal = goal_at() if goal is None else goal
    reward, over = learning_step(
        robot,
        task,
        before=place(here if before is None else before),
        after=place(here),
        goal=goal,
        ended=goal if ended is None else ended,
        previous=previous,
        command=command,
        effort=robot.costs.effort,
    )
    return float(reward[0]), bool(over[0])


def test_actuators_cost_by_their_share_of_full_command_and_by_its_change():
    robot = replace(BASE, costs=replace(BASE.costs, effort=0.3, change=0.2))
    full = robot.actuators.scale[None]
    free, _ = evaluated(POSITION, 1.0, robot=robot)
    held, _ = evaluated(POSITION, 1.0, robot=robot, previous=full, command=-full)
    assert free - held == pytest.approx(0.3 * 2 + 0.2 * 2 * 2.0**2)


def test_an_episode_ends_outside_the_geofence_and_not_before():
    fence = BASE.limits.geofence
    assert not evaluated(POSITION, fence - 0.01)[1]
    assert evaluated(POSITION, fence + 0.01)[1]


def test_touching_ends_an_episode_and_costs_what_the_task_says():
    here, far = (OBSTACLES.surveyed(goal_at(4.0, disc=(x, 0.0, 0.3)), BASE) for x in (0.0, -9.0))
    near, touches = evaluated(OBSTACLES, 0.0, goal=here)
    away, clear = evaluated(OBSTACLES, 0.0, goal=far)
    assert (touches, clear) == (True, False)
    assert away - near == pytest.approx(OBSTACLES.collision_cost + OBSTACLES.nearness_cost)


def test_a_task_without_a_place_has_no_geofence():
    assert not evaluated(VELOCITIES, 1e6)[1]


def test_where_the_block_went_counts_and_where_it_is_may_be_outside():
    start, moved = goal_at(block=(2.0, 0.0)), goal_at(block=(1.9, 0.0))
    stayed, _ = evaluated(PUSH, 3.0, goal=start)
    pushed, over = evaluated(PUSH, 3.0, goal=start, ended=moved)
    assert not over
    weights = PUSH.reward_weights
    nearness = weights.block * (np.exp(-1.9 / 0.25) - np.exp(-2.0 / 0.25))
    far_off = weights.block_far * (np.exp(-1.9 / 2.0) - np.exp(-2.0 / 2.0))
    gain = nearness + far_off + weights.push * 0.1
    assert pushed - stayed == pytest.approx(gain)
    far = goal_at(block=(BASE.limits.geofence + 0.1, 0.0))
    assert evaluated(PUSH, 3.0, goal=start, ended=far)[1]


def test_a_robot_that_leaves_its_block_behind_is_outside_too():
    start = goal_at(block=(2.0, 0.0))
    assert not evaluated(PUSH, BASE.limits.geofence - 0.1, goal=start)[1]
    assert evaluated(PUSH, BASE.limits.geofence + 0.1, goal=start)[1]


@pytest.mark.parametrize("name", config_names("tasks"))
def test_torch_rewards_as_numpy_does(name):
    torch = pytest.importorskip("torch")
    task = load_task(name)
    robot = robot_for(task, BASE)
    simulation = BatchSimulation(
        robot, task, load_scenario("randomised"), worlds=40, seed=2, dtype=np.float64
    )
    before, goal, previous = simulation.truth, simulation.goal, simulation.command
    simulation.step(np.tile(robot.actuators.scale, (40, 1)))
    given = {
        "before": before, "after": simulation.truth, "goal": goal, "ended": simulation.goal,
        "previous": previous, "command": simulation.command,
    }  # fmt: skip
    ours = learning_step(robot, task, effort=0.1, **given)
    theirs = learning_step(
        robot, task, effort=0.1, **{key: in_torch(value, torch) for key, value in given.items()}
    )
    np.testing.assert_allclose(theirs[0].numpy(), ours[0], rtol=0, atol=1e-9)
    np.testing.assert_array_equal(theirs[1].numpy(), ours[1])


def in_torch(value, torch):
    if isinstance(value, (Goal, State)):
        return value.mapped(torch.as_tensor)
    return torch.as_tensor(value)
