"""What a robot is and does, as one JSON object, and the controllers that it can be given."""

from __future__ import annotations

import json

import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.config.paths import config_names
from fulmar_core.loop.controller_choices import controller_choices
from fulmar_core.loop.robot_info import FORMS, RobotSetup, as_json, goal_form, robot_info
from fulmar_core.loop.teleop import can_be_driven, hand_mapping
from fulmar_core.robots.actuator_parts import KINDS, actuator_parts
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks import load_task

KEYS = (
    "name", "type", "kind", "task", "tolerance", "geofence", "area", "backend", "scenario", "controllers", "controller",
    "fallback", "control_hz", "clock", "started_ns", "version",
)  # fmt: skip


def info_of(robot: str, task: str = "", **setup) -> dict:
    it = load_robot(robot)
    return robot_info(it, load_task(task or it.kind.usual_task), RobotSetup(**setup))


@pytest.mark.parametrize("name", config_names("robots"))
def test_every_robot_has_every_key_and_fits_json(name):
    info = info_of(name, name="alpha", controller="policy", bundle=True)
    assert json.loads(as_json(info)) == json.loads(json.dumps(info))
    assert not set(KEYS) - info.keys()
    assert (info["name"], info["type"]) == ("alpha", name)
    assert info["goal"]["form"] in FORMS
    assert info["stops"]
    assert len(as_json(info)) < 20_000


@pytest.mark.parametrize("name", config_names("robots"))
def test_actuators_come_in_the_order_of_commands_with_their_range(name):
    robot = load_robot(name)
    parts = actuator_parts(robot)
    assert tuple(part.name for part in parts) == robot.actuators.names
    assert [part.full for part in parts] == robot.actuators.scale.tolist()
    assert {part.kind for part in parts} <= set(KINDS)


@pytest.mark.parametrize("name", config_names("robots"))
def test_a_person_can_drive_exactly_the_robots_that_hands_are_mapped_for(name):
    robot = load_robot(name)
    try:
        hand_mapping(robot)
    except ConfigError:
        assert not can_be_driven(robot)
    else:
        assert can_be_driven(robot)


@pytest.mark.parametrize(
    ("robot", "task", "form"),
    [
        ("floating_platform", "go_to_pose", "pose"),
        ("kingfisher", "go_to_position", "point"),
        ("turtlebot2", "track_velocities", "velocity"),
        ("jetbot", "go_through_positions", "path"),
        ("spacecraft_16", "go_to_pose_3d", "pose3"),
        ("cubesat_8", "go_to_position_3d", "point3"),
        ("int_ball2", "track_velocities_3d", "velocity3"),
        ("microsat", "point", "attitude"),
        ("airship_v7", "fly_hold", "flight"),
        ("airship_v7", "fly_b", "path"),
        ("navion", "fly_attitude", "attitude"),
    ],
)
def test_a_task_says_how_its_goals_look(robot, task, form):
    assert goal_form(load_task(task), load_robot(robot)) == form


@pytest.mark.parametrize(
    ("robot", "words"),
    [
        ("floating_platform", "the valves close; it keeps its velocity"),
        ("spacecraft_16", "keeps its velocity"),
        ("int_ball2", "the fans stop; it keeps its velocity"),
        ("kingfisher", "the propellers stop; it drifts to rest"),
        ("turtlebot2", "the wheels slow down and stop"),
        ("microsat", "keeps its turn rate"),
        ("airship_v7", "flies level and descends"),
    ],
)
def test_a_robot_says_what_stopping_means_for_it(robot, words):
    assert words in info_of(robot)["stops"]


def test_laws_a_policy_the_fallback_and_a_person_can_be_chosen_each_once():
    robot, task = load_robot("floating_platform"), load_task("go_to_pose")
    choices = controller_choices(robot, task, bundle=True, fallback="lqr", running="policy")
    names = [choice.name for choice in choices]
    assert names == ["policy", "lqr", "mpc", "lqr_drift", "fallback", "teleoperation"]
    assert all(choice.title for choice in choices)


def test_what_runs_is_on_the_list_even_where_nothing_else_would_put_it_there():
    names = [each["name"] for each in info_of("turtlebot2", controller="mine.module:Mine")["controllers"]]
    assert names == ["mine.module:Mine", "classical", "teleoperation"]


def test_a_law_that_does_not_do_the_task_cannot_be_chosen():
    names = [each["name"] for each in info_of("leatherback", "go_to_pose")["controllers"]]
    assert names == ["teleoperation"]


def test_in_lock_step_no_person_drives():
    info = info_of("floating_platform", lockstep=True)
    assert "teleoperation" not in [each["name"] for each in info["controllers"]]
    assert info["teleop"]["axes"] == []


def test_a_real_robot_goes_by_the_clock_on_the_wall_and_an_emulated_one_is_no_simulation():
    real = info_of("kingfisher", backend="hardware", emulated=True)
    assert (real["clock"], real["simulated"], real["emulated"]) == ("wall", False, True)
    assert info_of("kingfisher")["clock"] == "simulated"


def test_tolerances_that_do_not_count_are_left_out_and_no_area_is_none():
    info = info_of("floating_platform", "go_to_position", area=(-1.0, 1.0, -2.0, 2.0))
    assert set(info["tolerance"]) == {"position_m", "hold_s"}
    assert info["area"] == [-1.0, 1.0, -2.0, 2.0]
    assert info_of("floating_platform")["area"] == []


def test_a_task_among_things_in_space_says_their_parts():
    info = info_of("cubesat_8", "inspect")
    assert info["structures"]
    assert info["structures"][0]["parts"]
