"""`fulmar goals` before any node is up: what there is, and what is refused."""

from __future__ import annotations

import math
from dataclasses import fields

import pytest

from fulmar_bringup.goals_row import goals_spec
from fulmar_bringup.task_choice import single_file
from fulmar_cli.commands.goals import goals
from fulmar_core.config.errors import ConfigError, UnknownNameError
from fulmar_core.config.paths import config_names
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks.goal_files import Poses, Positions, load_goal_file, single_goal
from fulmar_ros.goal_node import GoalSettings


def call(name=None, robot=None, as_path=False, **more):
    return goals(name, robot=robot, as_path=as_path, control_hz=10.0, **more)


def test_without_a_name_every_file_is_listed_with_its_title(capsys):
    call()
    reported = capsys.readouterr().out
    for name in config_names("goals"):
        assert name in reported and load_goal_file(name).title in reported


def test_goals_are_somebody_s():
    with pytest.raises(ConfigError, match="--robot floating_platform"):
        call("circle")


@pytest.mark.parametrize(("name", "robot"), [("circel", "turtlebot2"), ("circle", "turtelbot2")])
def test_a_misspelt_name_gets_the_nearest(name, robot):
    with pytest.raises(UnknownNameError, match="Did you mean"):
        call(name, robot)


def test_a_file_that_is_not_there_is_named():
    with pytest.raises(ConfigError, match=r"nowhere/mine\.yaml"):
        call("nowhere/mine.yaml", "turtlebot2")


def test_a_path_to_follow_is_no_list_of_waypoints():
    with pytest.raises(ConfigError, match="only positions and poses"):
        call("circle", "turtlebot2", as_path=True)


@pytest.mark.parametrize("pose", ["1", "1,2,3,4", "1,two,3", "1,nan", ""])
def test_a_pose_on_the_command_line_has_two_or_three_finite_numbers(pose):
    with pytest.raises(ConfigError, match=r"--pose = .* (is no finite number|numbers?; .* are needed)"):
        call(robot="turtlebot2", pose=pose)


def test_a_pose_is_somebody_s_too():
    with pytest.raises(ConfigError, match="--pose 1,2,90 --robot floating_platform"):
        call(pose="1,2,90")


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (
            {"robot": "spacecraft_16", "pose": "1,0,90"},
            r"has 3 numbers.* its poses have 6, .*--position 1,0,90",
        ),
        (
            {"robot": "cubesat_wheels", "pose": "5,0,0,0,0,90"},
            r"x = 5 m would have no effect.*roll,pitch,yaw",
        ),
        (
            {"robot": "cubesat_wheels", "position": "5,0,0"},
            r"no position of 'cubesat_wheels'.*--pose roll,pitch,yaw",
        ),
        (
            {"robot": "floating_platform", "position": "1,0,90"},
            r"no position of 'floating_platform'.* x,y \[m\]",
        ),
        (
            {"robot": "floating_platform", "position": "1,0", "pose": "1,0"},
            "--pose and --position are two goals",
        ),
    ],
)
def test_what_a_kind_of_robot_does_not_take_is_refused_with_what_it_takes(given, words):
    with pytest.raises(ConfigError, match=words):
        call(**given)


@pytest.mark.parametrize(
    ("robot", "numbers", "option", "title"),
    [
        ("spacecraft_16", (1.0, 0.0, 0.5), "--position", "x 1, y 0, z 0.5 m, any attitude"),
        ("cubesat_wheels", (0.0, 20.0, 90.0), "--pose", "roll 0, pitch 20, yaw 90 degrees"),
        ("floating_platform", (1.0, -0.5), "--pose", "x 1, y -0.5 m, any heading"),
        ("floating_platform", (1.0, -0.5, 90.0), "--pose", "x 1, y -0.5 m, heading 90 degrees"),
    ],
)
def test_one_goal_is_what_its_option_and_its_robot_say(robot, numbers, option, title):
    assert single_file(numbers, option, load_robot(robot)).title == title


def test_a_file_and_a_pose_are_one_too_many():
    with pytest.raises(ConfigError, match="give one of them"):
        call("circle", "turtlebot2", pose="1,2")


def test_a_single_goal_is_a_position_without_a_heading_and_a_pose_with_one():
    position, pose = single_goal((1.0, -0.5)), single_goal((1.0, -0.5, 90.0))
    assert isinstance(position, Positions) and position.targets().tolist() == [[1.0, -0.5, 0.0]]
    assert isinstance(pose, Poses) and pose.targets().tolist() == [[1.0, -0.5, pytest.approx(math.pi / 2)]]
    assert "heading 90 degrees" in pose.title


def test_the_node_knows_every_parameter_it_is_given():
    spec = goals_spec("turtlebot2", "circle")
    assert spec.namespace == "/turtlebot2"
    assert set(spec.parameters) <= {field.name for field in fields(GoalSettings)}


@pytest.mark.parametrize(
    ("robot", "pose", "area", "words"),
    [
        ("spacecraft_16", "1,0,2,0,0,0", "-2,2,-2,2,-1,1", "z = 2 m lies outside the area of"),
        ("spacecraft_16", "1,0,2,0,0,0", "-2,2,-2,2", "where an area has 6 sides"),
        ("floating_platform", "3,0", "-2,2,-2,2", "x = 3 m, y = 0 m lies outside the area of"),
        ("floating_platform", "1,0", "-2,2,-2,2,-1,1", "where an area has 4 sides"),
        ("floating_platform", "1,0", "2,-2,-2,2", "--area = '2,-2,-2,2'"),
    ],
)
def test_a_goal_outside_of_the_area_is_not_sent(robot, pose, area, words):
    with pytest.raises(ConfigError) as caught:
        call(robot=robot, pose=pose, area=area)
    assert words in str(caught.value)
