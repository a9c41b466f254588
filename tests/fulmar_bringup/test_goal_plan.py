"""What a run takes from a goal file: task, start, length, and what is refused."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fulmar_bringup.controller_row import controller_spec
from fulmar_bringup.goal_plan import is_endless, shown_path, start_of
from fulmar_bringup.goals_row import run_goals_spec
from fulmar_bringup.launched_system import list_nodes
from fulmar_bringup.run_plan import RunPlan
from fulmar_bringup.task_choice import task_of, task_of_goals
from fulmar_core.config.errors import ConfigError
from fulmar_core.tasks.goal_files import load_goals


@pytest.fixture
def plan(plan):
    """Function that plans a run with goals from a file."""

    def make(goals, **changes):
        return plan(
            **{"task": task_of_goals(goals), "controller": "classical", "lockstep": True} | changes,
            goals=goals,
        )

    return make


@pytest.fixture
def file(tmp_path):
    def write(text):
        path = tmp_path / "mine.yaml"
        path.write_text(text)
        return str(path)

    return write


TURNS = "kind: poses\ntitle: turns\nposes: [[0, 0, 0, 0, 0, 90], [0, 0, 0, 0, 0, -90]]\n"
FAR = "kind: positions\ntitle: far\npositions: [[0.0, 0.0], [30.0, 0.0]]\n"
NEAR = "kind: positions\ntitle: near\npositions: [[7.0, 0.0], [7.0, 1.0]]\n"
ROUND = (
    "kind: path\ntitle: round\npath: {kind: circle, radius: 1.0}\nspeed: 0.25\nlook_ahead: 0.1\nloops: 0\n"
)


@pytest.mark.parametrize(
    ("goals", "task"),
    [
        ("lab_pose", "go_to_pose"),
        ("lake_square", "go_to_position"),
        ("velocity_steps", "track_velocities"),
        ("circle", "track_velocities"),
    ],
)
def test_every_kind_of_goals_has_a_task(goals, task):
    assert task_of_goals(goals) == task


def test_a_path_is_begun_at_its_beginning_and_lasts_as_long_as_it_takes(plan):
    request = plan("circle")
    x, y, heading = request.start
    points = load_goals("circle").planner().points
    assert (x, y) == pytest.approx(tuple(points[0]))
    assert math.radians(heading) == pytest.approx(math.atan2(*(points[1] - points[0])[::-1]))
    assert request.duration_s > 2 * math.pi * 1.5 / 0.25
    assert request.goal is None


@pytest.mark.parametrize(
    ("given", "task"),
    [({}, "point"), ({"goal": (0.0, 0.0, 0.0, 0.0, 0.0, 40.0)}, "slew"), ({"goals": "turns"}, "slew")],
)
def test_a_satellite_turns_to_goals_and_else_points_to_the_earth(file, given, task):
    if "goals" in given:
        given = {"goals": file(TURNS)}
    found = task_of(RunPlan("cubesat_wheels", "", "lqr", "mujoco", **given))
    assert found == task


def test_a_satellite_has_the_time_that_its_turns_take(plan, file):
    request = plan(file(TURNS), robot="cubesat_wheels", task="slew", start=(0.0,) * 6)
    assert request.duration_s == pytest.approx(2 * 20.0 + 3.0 * math.radians(90.0 + 180.0) / 0.03 + 5.0)


def test_a_file_of_poses_of_a_satellite_has_no_places(plan, file):
    goals = file("kind: poses\ntitle: away\nposes: [[0, 0, 0, 0, 0, 90], [5, 0, 0, 0, 0, 90]]\n")
    with pytest.raises(
        ConfigError, match=r"'5,0,0,0,0,90': x = 5 m would have no effect, 'cubesat_wheels' goes to no"
    ):
        plan(goals, robot="cubesat_wheels", task="slew", start=(0.0,) * 6)


def test_velocities_begin_at_the_origin_and_end_a_little_after_the_last(plan):
    request = plan("velocity_steps")
    assert request.start == (0.0, 0.0, 0.0)
    assert 26.0 < request.duration_s < 35.0


def test_places_are_begun_as_far_from_the_first_as_the_seed_s_episode_is(plan, file):
    request = plan(file(NEAR))
    assert 0.5 <= math.dist(request.start[:2], (7.0, 0.0)) <= 5.0
    assert request.goals.endswith("mine.yaml")


def test_what_is_said_counts_more_than_what_follows_from_the_file(plan):
    request = plan("circle", start=(0.0, 1.0, 0.0), duration_s=7.0)
    assert (request.start, request.duration_s) == ((0.0, 1.0, 0.0), 7.0)


@pytest.mark.parametrize(
    ("goals", "change", "words"),
    [
        ("circle", {"task": "go_to_pose"}, "no goals of task 'go_to_pose'.*are for 'track_velocities'"),
        ("lab_pose", {"task": "go_to_position_with_obstacles"}, "no goals of task"),
        ("lake_square", {"task": "go_through_poses"}, "no goals of task"),
        ("circle", {"goal": (0.0, 0.0, 0.0)}, "it takes no --goal"),
        ("circel", {"task": "go_to_pose"}, "Did you mean 'circle'"),
    ],
)
def test_what_does_not_go_together_is_refused(plan, goals, change, words):
    with pytest.raises(ConfigError, match=words):
        plan(goals, **{"task": "track_velocities"} | change)


@pytest.mark.parametrize(
    ("robot", "velocity", "words"),
    [
        ("turtlebot2", "[0.0, 0.0, 1000.0]", r"1000 deg/s; 'turtlebot2' turns with at most"),
        ("floating_platform", "[0.0, 0.0, 1000.0]", r"1000 deg/s; 'floating_platform' turns with at most"),
        (
            "leatherback",
            "[0.0, 0.0, 20.0]",
            r"20 deg/s at 0 m/s; 'leatherback' turns in no circle of less than",
        ),
    ],
)
def test_turn_rates_that_the_robot_cannot_have_are_refused(plan, file, robot, velocity, words):
    goals = file(f"kind: velocities\ntitle: spin\nvelocities: [{{velocity: {velocity}, hold_s: 5.0}}]\n")
    with pytest.raises(ConfigError, match=words):
        plan(goals, robot=robot)


def test_places_beyond_the_geofence_of_each_other_are_refused(plan, file):
    with pytest.raises(ConfigError, match=r"targets 1 and 2 are 30\.0 m apart"):
        plan(file(FAR))


def test_endless_rounds_have_the_length_of_one_and_are_known_for_endless(plan, file):
    goals = file(ROUND)
    assert is_endless(load_goals(goals))
    assert not is_endless(load_goals("circle"))
    assert 25.0 < plan(goals).duration_s < 40.0


def test_the_path_to_show_is_closed_and_small():
    path = np.array(shown_path(load_goals("circle")))
    assert len(path) < 1000
    assert path[0].tolist() == path[-1].tolist()
    assert np.allclose(np.hypot(*path.T), 1.5, atol=1e-3)
    assert shown_path(load_goals("lab_pose")) == []


def test_a_path_s_start_is_no_place_s_start():
    assert start_of(load_goals("lab_pose")) is None


def test_a_run_s_goal_node_waits_for_nobody_and_its_controller_for_it(plan):
    request = plan("circle")
    parameters = run_goals_spec(request).parameters
    assert parameters.items() >= {"lockstep": True, "stay": True, "control_hz": 5.0}.items()
    assert controller_spec(request).parameters["goals_streamed"] is True
    assert controller_spec(plan_without(request)).parameters["goals_streamed"] is False


def plan_without(request):
    from dataclasses import replace

    return replace(request, goals="")


def test_a_system_with_goals_has_a_node_more():
    nodes = list_nodes(task="track_velocities", controller="classical", goals="circle")
    assert [node.name for node in nodes] == ["recorder", "plant", "controller", "goals", "markers"]
    assert nodes[3].parameters["goals"].endswith("configs/goals/circle.yaml")
