"""What every controller promises, learned or classical, for every robot and task that there is one for."""

from __future__ import annotations

import copy
import json
from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.config.paths import config_names
from fulmar_core.controllers.by_kind import LAWS, laws_of
from fulmar_core.estimators.actuator_health.filters import HealthSettings
from fulmar_core.estimators.images import nothing_seen
from fulmar_core.loop.control_loop import ControlLoop
from fulmar_core.loop.policy_bundle import read_passport
from fulmar_core.robots.actuators.families import BASES, FAMILIES, row_of
from fulmar_core.robots.kinds import KINDS
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.states.planar import at_rest
from fulmar_core.states.spatial import SpatialState, position_of, quat_of
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal import goal_in_float64
from fulmar_core.worlds.scenario import load_scenario
from policy_server.controllers import CONTROLLERS, Choice, load_controller, shipped_policies
from tests.conftest import ALIKE
from tests.inputs import some_of
from tests.new_robots import robots_of_every_family
from tests.pairs import covering

ROBOTS = robots_of_every_family()
TASKS = {name: load_task(name) for name in config_names("tasks")}
LEARNED = {
    (passport.robot, passport.task): str(folder)
    for folder, passport in ((folder, read_passport(folder)) for folder in shipped_policies())
}
WORLDS = 5


SAID = {}  # whether a controller does a kind of task on a robot: some solve for their gains before they say so


def has_one(name, robot, task):
    """Whether a controller says that it does a task on a robot."""
    if name == "policy":
        return (robot.name, task.name) in LEARNED
    if robot.flies:  # gains of eight aircraft by rule take seconds, in each process that collects tests
        robot = ROBOTS[ALIKE.get(robot.name, robot.name)]
    key = name, robot.name, task.kind
    if key not in SAID:
        try:
            CONTROLLERS[name].check(robot, task)
            SAID[key] = True
        except ConfigError:
            SAID[key] = False
    return SAID[key]


LOADED = [name for name, entry in CONTROLLERS.items() if not entry.is_external]
CASES = [
    (name, robot, task)
    for name in LOADED
    for robot in ROBOTS.values()
    for task in TASKS.values()
    if has_one(name, robot, task)
]
# Each bundle is a controller of its own; of the others, each robot and each task that differs from others by more than
# figures comes once with every one.
QUICK = {
    (name, *pair)
    for name in LOADED
    for pair in covering(
        (robot.name, task.name)
        for other, robot, task in CASES
        if other == name and not {robot.name, task.name} & set(ALIKE)
    )
} | {("policy", *pair) for pair in LEARNED}


def rate_of(name, robot, task):
    """Command rate that a controller runs at: of a policy that which it was trained at, else the robot's [Hz]."""
    if name == "policy":
        return read_passport(Path(LEARNED[robot.name, task.name])).control_hz
    return robot.timing.control_hz


def marked(name, robot, task):
    """A case as a parameter; slow where the quick ones do without it."""
    names = (name, robot.name, task.name)
    # LQR, and the law that `classical` stands for, solve for their gains as LQI does; one aircraft shows the rest.
    alike = robot.flies and robot.name != "airship_v7" and name in ("classical", "lqr")
    marks = () if names in QUICK and not alike else pytest.mark.slow
    return pytest.param((name, robot, task), id="-".join(names), marks=marks)


@pytest.fixture(params=[marked(*case) for case in CASES], scope="module")
def case(request):
    name, robot, task = request.param
    policy = LEARNED.get((robot.name, task.name), "")
    controller = load_controller(name, robot, task, Choice(rate_of(name, robot, task), policy))
    return name, robot, task, controller


def measured(robot, task, controller, simulation, *, steps=0):
    """Inputs of robots that have moved about for some steps."""
    loop = ControlLoop(robot, task, controller, robots=simulation.worlds)
    loop.begin(goal_in_float64(simulation.goal))
    loop.reset()
    rng, size = np.random.default_rng(1), loop.previous.shape
    images = {
        name: np.repeat(image, simulation.worlds, axis=0)
        for name, image in nothing_seen(robot, controller.readings).items()
    }
    for number in range(steps):
        inputs = loop.inputs(simulation.measured, simulation.readings | images, round(1e9 * number * loop.dt))
        simulation.move(loop.take(inputs, robot.actuators.scale * rng.uniform(-1.0, 1.0, size)).command)
        loop.goal = goal_in_float64(loop.goal.among(simulation.things))
    return loop.inputs(simulation.measured, simulation.readings | images, round(1e9 * steps * loop.dt))


@pytest.fixture(scope="module")
def seen(case):
    """Inputs of robots that have moved about for a while."""
    _, robot, task, controller = case
    simulation = BatchSimulation(robot, task, load_scenario("nominal"), worlds=WORLDS, seed=12)
    return measured(robot, task, controller, simulation, steps=10)


def answers(controller, inputs):
    """Command for each robot by itself, of a controller that remembers nothing."""
    commands = []
    for i in range(len(inputs.previous)):
        controller.reset()
        commands.append(controller.act(some_of(inputs, slice(i, i + 1)))[0])
    return commands


def test_every_controller_and_every_robot_is_under_this_contract():
    assert {name for name, _, _ in CASES} == set(LOADED)
    assert {robot.name for name, robot, _ in CASES if name == "classical"} == set(ROBOTS)
    assert ("floating_platform", "go_to_pose") in LEARNED


def test_it_has_its_name_its_rate_and_asks_for_an_estimator_or_none(case):
    name, robot, task, controller = case
    assert controller.name == name
    assert controller.control_hz == rate_of(name, robot, task)
    assert controller.estimator is None or isinstance(controller.estimator, HealthSettings)


def test_each_robot_gets_the_command_that_it_would_get_alone(case, seen):
    _, robot, _, controller = case
    controller.reset()
    many = controller.act(seen)
    count = len(robot.actuators.names)
    assert many.shape == (WORLDS, count)
    assert controller.act(some_of(seen, slice(0, 1))).shape == (1, count)
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
    _, robot, task, controller = case
    simulation = BatchSimulation(robot, task, load_scenario("ideal"), worlds=1, seed=1)
    goal = simulation.goal
    target = np.asarray(goal.targets[:, 0], dtype=float)
    in_space, tracks = task.state_type is SpatialState, task.goal_topic == "goal_velocity"
    targets = 0.0 * target if tracks else target
    if in_space:
        place = np.array([[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]]) if tracks else target
        still = SpatialState.at_rest(position_of(place), quat_of(place))
    else:
        still = at_rest(*targets.T)
    goal = replace(goal, targets=targets[:, None], things=dict.fromkeys(goal.things, targets))
    simulation.put(still, goal, simulation.command)
    controller.reset()
    assert np.isfinite(controller.act(measured(robot, task, controller, simulation))).all()


def test_it_remembers_nothing_that_a_reset_would_not_clear(case, seen):
    controller = case[3]
    controller.reset()
    first = controller.act(seen)
    controller.act(some_of(seen, slice(None, None, -1)))
    controller.reset()
    np.testing.assert_array_equal(controller.act(seen), first)


def test_it_leaves_its_inputs_alone(case, seen):
    kept = numbers_of(copy.deepcopy(seen))
    case[3].act(seen)
    for name, value in numbers_of(seen).items():
        np.testing.assert_array_equal(value, kept[name], err_msg=name)


def numbers_of(value, name=""):
    """Every array of some inputs by its name."""
    if is_dataclass(value):
        parts = [numbers_of(getattr(value, each.name), f"{name}.{each.name}") for each in fields(value)]
        return {key: array for part in parts for key, array in part.items()}
    if isinstance(value, Mapping):
        return {f"{name}.{key}": array for key, array in value.items()}
    return {name: value}


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
        if name == "lqr" and "lqr" not in laws_of(robot):
            expected = (
                rf"'lqr' is for .* with thrusters or fans, .*; '{robot.name}' .*Use --controller classical"
            )
        elif robot.kind in task.kinds:
            expected = (
                rf"on '{robot.name}' .*there is one for: (go_to_|point|follow_).*Use --controller policy"
            )
        else:
            expected = rf"task '{task.name}' is for .*; '{robot.name}' is one of the .*`fulmar list tasks` shows others"
        with pytest.raises(ConfigError, match=expected):
            load_controller(name, robot, task, Choice(robot.timing.control_hz))


def test_every_law_drives_a_family_and_every_family_names_a_law():
    for name, family in FAMILIES.items():
        assert any(row_of(families, family) for families in LAWS.values()), name
    assert {family for families in LAWS.values() for family in families} <= set(FAMILIES | BASES)
    assert set(LAWS) == set(KINDS)
