"""docs/observations.md describes every observation term as the code computes it."""

from __future__ import annotations

import re

import numpy as np
import pytest

from fulmar_core.config.paths import config_names
from fulmar_core.controllers.disturbance_inputs import PUSH_TERMS, disturbance_terms
from fulmar_core.robots.kinds.aircraft import AIRCRAFT
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.states.attitude import exponential
from fulmar_core.states.planar import PlanarState
from fulmar_core.states.spatial import SpatialState
from fulmar_core.tasks import load_task
from fulmar_core.tasks.go_to_position_with_obstacles import GoToPositionWithObstacles
from fulmar_core.tasks.goal import Goal, no_obstacles
from fulmar_core.tasks.observation import Observer
from fulmar_core.worlds.scenario import load_scenario

TASKS = config_names("tasks")
UNITS = {"fine_distance": " m", "fine_heading_deg": "°", "fine_speed": " m/s", "fine_velocity": " m/s"} | {
    "fine_yaw_rate": " rad/s",
    "fine_angle": " rad",
    "fine_rate": " rad/s",
}
RANGES = {
    "any": (-np.inf, np.inf),
    "0 and more": (0.0, np.inf),
    "-1 to 1": (-1.0, 1.0),
    "-3 to 3": (-3.0, 3.0),
    "0 to 1": (0.0, 1.0),
    "-π to π": (-np.pi, np.pi),
}
ROBOT_OF = {PlanarState: load_robot("leatherback"), SpatialState: load_robot("spacecraft_16")}
SLIGHTLY = (0.2, 0.3, 0.4)  # rotation vector to a goal's attitude [rad]
# No attitude makes all six entries of a rotation matrix positive; these turns make one each.
TURNS = {
    "rotation_to_goal_12": (0.0, 0.0, -0.5),
    "rotation_to_goal_13": (0.0, 0.5, 0.0),
    "rotation_to_goal_21": (0.0, 0.0, 0.5),
    "rotation_to_goal_23": (-0.5, 0.0, 0.0),
}


def rows(page, title):
    """Cells of the table below a heading, without its head."""
    part = page.split(f"## {title}\n")[1].split("\n## ")[0]
    lines = [line for line in part.splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[2:]]


@pytest.fixture(scope="module")
def page(repository):
    return (repository / "docs" / "observations.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def terms(page):
    """Every term of the tasks with its row."""
    named = [
        (name, row) for row in rows(page, "Terms of the tasks") for name in re.findall(r"`(\w+)`", row[0])
    ]
    assert len(named) == len(dict(named)), "a term has two rows"
    return dict(named)


def test_the_table_has_exactly_the_terms_of_all_tasks(terms):
    assert set(terms) == {name for task in TASKS for name in load_task(task).observation_names}


@pytest.mark.parametrize("task", TASKS)
def test_values_stay_in_the_stated_range(terms, task):
    flies, rounding = AIRCRAFT in load_task(task).kinds, 1e-5
    robot = load_robot("airship_v7") if flies else ROBOT_OF[load_task(task).state_type]
    scenario = load_scenario("randomised")
    worlds = BatchSimulation(robot, load_task(task), scenario, worlds=64, seed=1)
    seen = []
    for _ in range(5):
        worlds.step(np.full(worlds.command.shape, 0.5) * robot.actuators.scale)
        seen.append(np.asarray(worlds.observe()))
    values = np.vstack(seen)
    for name, column in zip(load_task(task).observation_names, values.T, strict=False):
        low, high = RANGES[terms[name][5]]
        assert (column >= low - rounding).all(), name
        assert (column <= high + rounding).all(), name


def terms_on_one_side(task, side):
    """Terms of a robot at the origin with heading 0; everything is ahead and to one side (1 left, -1 right)."""
    return (in_plane if task.state_type is PlanarState else in_space)(task, side)


def in_plane(task, side):
    state = PlanarState(*(np.array([value]) for value in (0.0, 0.0, 0.0, 0.2, 0.1 * side, 0.3 * side)))
    ahead = [[[3.0, 2.0 * side, 0.5 * side], [4.0, 3.0 * side, 0.6 * side], [5.0, 4.0 * side, 0.7 * side]]]
    discs = np.array([[[1.0, 3.0 * side, 0.2], [0.5, 4.0 * side, 0.2], [2.0, 5.0 * side, 0.2]]])
    goal = Goal(np.array(ahead), np.zeros(1), discs, {"block": np.array([[1.0, 0.5 * side, 0.0]])})
    if isinstance(task, GoToPositionWithObstacles):
        goal = task.surveyed(goal, load_robot("turtlebot2"))
    return dict(
        zip(task.observation_names, (float(term[0]) for term in task.observe(state, goal)), strict=True)
    )


def in_space(task, side):
    """The same with everything above, too; rotations about x and z are mirrored with what they turn."""
    turned = np.array([side, 1.0, side])
    at = SpatialState(*np.array([[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.2, 0.1 * side, 0.3, *0.2 * turned]]).T)
    places = np.array([[3.0, 2.0 * side, 1.0], [4.0, 3.0 * side, 1.5], [5.0, 4.0 * side, 2.0]])

    def observed(turn):
        aside = turned if task.goal_topic == "goal_velocity" else exponential(tuple(turned * turn))
        targets = np.concatenate((places, np.tile(aside, (3, 1))), axis=-1)
        goal = Goal(targets[None], np.zeros(1), no_obstacles(1))
        if task.moves:  # ever faster, and turning faster than the body
            targets[:, :3] += np.array([[0.0], [1.0], [4.0]]) * (places[1] - places[0])
            for later in (1, 2):
                targets[later, 3:] = exponential(tuple(turned * np.add(turn, 0.5 * later)))
            goal = task.begun(goal, at)
        return dict(zip(task.observation_names, task.observe(at, goal), strict=True))

    shown = {
        name: next((turn for end, turn in TURNS.items() if name.endswith(end)), SLIGHTLY)
        for name in task.observation_names
    }
    return {name: float(observed(turn)[name][0]) for name, turn in shown.items()}


@pytest.mark.parametrize("task", [task for task in TASKS if AIRCRAFT not in load_task(task).kinds])
def test_signs_are_the_stated_ones(terms, task):
    left, right = (terms_on_one_side(load_task(task), side) for side in (1.0, -1.0))
    for name, value in left.items():
        assert value > 0.0, name
        sideways = re.search("left|counter-clockwise", terms[name][2])
        assert right[name] == pytest.approx(-value if sideways else value), name


def test_the_table_of_tasks_has_terms_and_scales_of_each_task(page):
    written = {row[0].strip("`"): row[1:] for row in rows(page, "Scales of each task")}
    expected = {}
    for name in TASKS:
        task = load_task(name)
        scales = [
            f"`{key}` {getattr(task, key):g}{unit}" for key, unit in UNITS.items() if getattr(task, key, 0.0)
        ]
        expected[name] = [str(len(task.observation_names)), ", ".join(scales) or "none"]
    assert written == expected


def test_a_key_as_scale_exists_in_every_task_with_the_term(terms):
    for task in map(load_task, TASKS):
        for name in task.observation_names:
            key = terms[name][6].strip("`")
            assert key not in UNITS or getattr(task, key) > 0.0, (task.name, name)


def test_robots_with_terms_of_their_own_are_listed(page):
    table = {row[0]: row for row in rows(page, "Terms of the robot")}
    task = load_task("go_to_position")
    with_memory = {
        name
        for name in config_names("robots")
        if len(Observer(load_robot(name), task).names) > len(task.observation_names)
    }
    assert set(re.findall(r"`(\w+)`", table["`previous_` and the actuator's name"][2])) == with_memory
    robot = load_robot("floating_platform")
    assert disturbance_terms(robot) == (*PUSH_TERMS, *(f"{valve}_alive" for valve in robot.actuators.names))
    for term in PUSH_TERMS:
        assert any(f"`{term}`" in first for first in table), term
