"""What every controller promises, learned or classical, for every robot and task that there is one for."""

from __future__ import annotations

import json

import numpy as np
import pytest

from fulmar_bringup.system import CONTROLLERS
from fulmar_core.controllers.classical import LAWS
from fulmar_core.disturbances.scenario import load_scenario
from fulmar_core.errors import ConfigError
from fulmar_core.observation import Observer
from fulmar_core.paths import config_names
from fulmar_core.policy_bundle import read_passport
from fulmar_core.robot import load_robot
from fulmar_core.simulation import BatchSimulation
from fulmar_core.tasks import load_task
from policy_server.shipped import shipped_policies
from tests.pairs import covering

ROBOTS = {name: load_robot(name) for name in config_names("robots")}
TASKS = {name: load_task(name) for name in config_names("tasks")}
LEARNED = {
    (passport.robot, passport.task): str(folder)
    for folder, passport in ((folder, read_passport(folder)) for folder in shipped_policies())
}
WORLDS = 12


def has_one(name, robot, task):
    """Whether a controller says that it does a task on a robot."""
    if name == "policy":
        return (robot.name, task.name) in LEARNED
    try:
        CONTROLLERS[name].check(robot, task)
    except ConfigError:
        return False
    return True


CASES = [
    (name, robot, task)
    for name in CONTROLLERS
    for robot in ROBOTS.values()
    for task in TASKS.values()
    if has_one(name, robot, task)
]
# Each bundle is a controller of its own; of the others, each robot and each task comes once with every one.
QUICK = {
    (name, *pair)
    for name in CONTROLLERS
    for pair in covering((robot.name, task.name) for other, robot, task in CASES if other == name)
} | {("policy", *pair) for pair in LEARNED}


def marked(name, robot, task):
    """A case as a parameter; slow where the quick ones do without it."""
    names = (name, robot.name, task.name)
    marks = () if names in QUICK else pytest.mark.slow
    return pytest.param((name, robot, task), id="-".join(names), marks=marks)


@pytest.fixture(params=[marked(*case) for case in CASES], scope="module")
def case(request):
    name, robot, task = request.param
    policy = LEARNED.get((robot.name, task.name), "")
    controller = CONTROLLERS[name].load(robot, task, robot.timing.control_hz, policy)
    return name, robot, task, controller


@pytest.fixture
def seen(case):
    """Observations of robots that have moved about for a while."""
    _, robot, task, _ = case
    simulation = BatchSimulation(robot, task, load_scenario("nominal"), worlds=WORLDS, seed=12)
    rng, size = np.random.default_rng(1), (WORLDS, len(robot.actuators.names))
    for _ in range(10):
        simulation.step(robot.actuators.scale * rng.uniform(-1.0, 1.0, size))
    return simulation.observe()


def answers(controller, rows):
    """What a controller that remembers nothing says to each of some observations."""
    told = []
    for row in rows:
        controller.reset()
        told.append(controller.act(row))
    return told


def test_every_controller_and_every_robot_is_under_this_contract():
    assert {name for name, _, _ in CASES} == set(CONTROLLERS)
    assert {robot.name for name, robot, _ in CASES if name == "classical"} == set(ROBOTS)
    assert ("floating_platform", "go_to_pose") in LEARNED


def test_it_takes_what_the_robot_sees_at_its_task(case):
    name, robot, task, controller = case
    assert controller.name == name
    assert controller.observation_names == Observer(robot, task).names
    assert controller.control_hz == robot.timing.control_hz


def test_one_observation_gives_one_command_and_a_batch_gives_a_batch(case, seen):
    _, robot, _, controller = case
    controller.reset()
    many = controller.act(seen)
    count = len(robot.actuators.names)
    assert np.shape(many) == (WORLDS, count)
    assert np.shape(controller.act(seen[0])) == (count,)
    assert np.shape(controller.act(seen[:1])) == (1, count)
    np.testing.assert_allclose(answers(controller, seen), many, rtol=1e-5, atol=1e-5)


def test_commands_are_finite_and_already_what_the_hardware_can_do(case, seen):
    _, robot, _, controller = case
    controller.reset()
    commands = np.asarray(controller.act(seen))
    assert np.isfinite(commands).all()
    if controller.name == "policy":  # cut to full command; the node limits it further
        assert (np.abs(commands) <= robot.actuators.scale * (1.0 + 1e-6)).all()
        return
    np.testing.assert_allclose(robot.actuators.limited(commands), commands, rtol=1e-12, atol=1e-12)
    assert np.abs(commands).max() > 0.0


def test_it_answers_a_robot_at_rest_where_it_shall_be(case):
    controller = case[3]
    controller.reset()
    assert np.isfinite(controller.act(np.zeros(len(controller.observation_names)))).all()


def test_it_remembers_nothing_that_a_reset_would_not_clear(case, seen):
    controller = case[3]
    controller.reset()
    first = controller.act(seen)
    controller.act(seen[::-1])
    controller.reset()
    np.testing.assert_array_equal(controller.act(seen), first)


def test_it_leaves_its_input_alone(case, seen):
    kept = seen.copy()
    case[3].act(seen)
    np.testing.assert_array_equal(seen, kept)


def test_its_metadata_is_json_and_names_who_and_what_with_a_hash(case):
    name, robot, task, controller = case
    metadata = json.loads(json.dumps(controller.metadata(), allow_nan=False))
    assert (metadata["controller"], metadata["robot"], metadata["task"]) == (name, robot.name, task.name)
    assert metadata["control_hz"] == controller.control_hz
    assert len(metadata["sha256"]) == 64


@pytest.mark.parametrize("name", ["lqr", "classical"])
def test_pairs_without_a_law_are_refused_with_what_to_use_instead(name):
    lacking = [(r, t) for r in ROBOTS.values() for t in TASKS.values() if not has_one(name, r, t)]
    assert lacking
    for robot, task in lacking:
        with pytest.raises(ConfigError, match="Use --controller") as told:
            CONTROLLERS[name].load(robot, task, robot.timing.control_hz, "")
        words = str(told.value)
        assert f"'{robot.name}'" in words
        assert "is for robots with thrusters" in words or "there is one for: go_to_" in words


def test_the_table_of_laws_knows_every_family():
    assert set(LAWS) == {robot.actuators.kind for robot in ROBOTS.values()}
