"""What every controller promises, learned or classical."""

from __future__ import annotations

import json

import numpy as np
import pytest

from fulmar_bringup.system import CONTROLLERS
from fulmar_core.controllers.lqr import load_lqr
from fulmar_core.paths import config_names
from fulmar_core.robot import load_robot
from fulmar_core.state import planar_pose, planar_state
from fulmar_core.tasks import load_task
from policy_server.policy import Policy
from policy_server.shipped import shipped_policy

ROBOT = load_robot("floating_platform")


def build_policy(robot, task):
    folder = shipped_policy(robot.name, task.name)
    return None if folder is None else Policy(folder, robot, task)


BUILDERS = {"lqr": load_lqr, "policy": build_policy}
CASES = [
    (name, task)
    for name in sorted(BUILDERS)
    for task in config_names("tasks")
    if name != "policy" or shipped_policy(ROBOT.name, task)
]


@pytest.fixture(params=CASES, ids=lambda case: " ".join(case))
def case(request):
    name, task = request.param
    the_task = load_task(task)
    return name, the_task, BUILDERS[name](ROBOT, the_task)


def situations(task, count=200):
    rng = np.random.default_rng(12)
    state = planar_state(
        *rng.uniform(-3, 3, (3, count)), vx=rng.normal(size=count), yaw_rate=rng.normal(size=count)
    )
    return task.observe(state, planar_pose(*rng.uniform(-3, 3, (3, count))))


def test_every_controller_is_under_this_contract():
    assert set(BUILDERS) == set(CONTROLLERS)
    assert ("policy", "go_to_pose") in CASES


def test_it_takes_what_its_task_sees(case):
    name, task, controller = case
    assert controller.name == name
    assert controller.observation_names == task.observation_names
    assert controller.control_hz == ROBOT.timing.control_hz


def test_one_observation_gives_one_command_and_a_batch_gives_a_batch(case):
    _, task, controller = case
    seen = situations(task)
    many = controller.act(seen)
    assert many.shape == (200, len(ROBOT.actuators.names))
    assert controller.act(seen[0]).shape == (len(ROBOT.actuators.names),)
    assert controller.act(seen[:1]).shape == (1, len(ROBOT.actuators.names))
    np.testing.assert_array_equal([controller.act(row) for row in seen], many)


def test_commands_are_already_what_the_hardware_can_do(case):
    _, task, controller = case
    commands = controller.act(situations(task))
    np.testing.assert_array_equal(ROBOT.actuators.limited(commands), commands)
    assert 0.0 < commands.mean() < 1.0


def test_it_has_no_memory_that_a_reset_would_not_clear(case):
    _, task, controller = case
    seen = situations(task)
    first = controller.act(seen)
    controller.act(seen[::-1])
    controller.reset()
    np.testing.assert_array_equal(controller.act(seen), first)


def test_it_leaves_its_input_alone(case):
    _, task, controller = case
    seen = situations(task)
    kept = seen.copy()
    controller.act(seen)
    np.testing.assert_array_equal(seen, kept)


def test_its_metadata_is_json_and_names_who_and_what_with_a_hash(case):
    name, task, controller = case
    metadata = json.loads(json.dumps(controller.metadata(), allow_nan=False))
    assert (metadata["controller"], metadata["robot"], metadata["task"]) == (name, ROBOT.name, task.name)
    assert metadata["control_hz"] == controller.control_hz
    assert len(metadata["sha256"]) == 64


def test_it_heads_for_the_goal_from_every_side(case):
    _, task, controller = case
    bearings = np.linspace(-np.pi, np.pi, 24, endpoint=False)
    goal = planar_pose(np.zeros(24), np.zeros(24), np.zeros(24))
    state = planar_state(2 * np.cos(bearings), 2 * np.sin(bearings), np.zeros(24))
    force, _ = ROBOT.actuators.wrench_in_body(controller.act(task.observe(state, goal)))
    towards = -(force[:, 0] * np.cos(bearings) + force[:, 1] * np.sin(bearings))
    assert np.mean(towards > 0.0) > 0.8  # a policy may turn first where that is better
