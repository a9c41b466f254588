"""The task of a run that names none."""

from __future__ import annotations

from pathlib import Path

import pytest

from fulmar_bringup.task_choice import check_heading, default_task
from fulmar_cli.commands.values import read_goal
from fulmar_core.config.errors import ConfigError


@pytest.mark.parametrize(
    ("robot", "controller"),
    [("jetbot", "classical"), ("modular_freeflyer", "lqr"), ("floating_platform", "policy")],
)
def test_three_numbers_are_a_pose_and_two_a_position_whichever_policies_are_shipped(robot, controller):
    """No policy for poses is shipped for the first two robots, and none is asked for."""
    assert default_task(robot, controller, goal=(0.0, 0.0, 90.0)) == "go_to_pose"
    assert default_task(robot, controller) == "go_to_pose"
    assert default_task("jetbot", controller if robot == "jetbot" else "policy", goal=(1.0, 2.0)) == (
        "go_to_position"
    )


@pytest.mark.parametrize(
    ("robot", "controller", "goal", "words"),
    [
        (
            "jetbot",
            "policy",
            (1.0, 2.0, 90.0),
            "a run with --goal 1,2,90 is go_to_pose: no policy is shipped for 'jetbot' and 'go_to_pose'. "
            "Say --task go_to_position or --goal x,y, or --controller classical.",
        ),
        ("leatherback", "classical", (1.0, 2.0, 90.0), "Say --task go_to_position or --goal x,y."),
        ("floating_platform", "mpc", (1.0, 2.0), "Say --task go_to_pose or --goal x,y,deg, or --controller"),
    ],
)
def test_what_a_controller_cannot_do_is_refused_with_what_it_can(robot, controller, goal, words):
    with pytest.raises(ConfigError) as caught:
        default_task(robot, controller, goal=goal)
    assert words in str(caught.value)


def test_a_policy_that_was_given_need_not_be_shipped():
    assert default_task("jetbot", "policy", goal=(1.0, 2.0, 9.0), policy=Path("mine")) == "go_to_pose"


def test_a_named_task_that_needs_a_heading_refuses_a_goal_without_one():
    with pytest.raises(ConfigError, match="task 'go_to_pose' needs a heading: --goal x,y,deg"):
        check_heading("go_to_pose", (1.0, 2.0))
    assert not check_heading("go_to_pose", (1.0, 2.0, 3.0))


def test_a_heading_that_a_named_task_does_not_have_is_said_to_have_no_effect():
    assert "the 90 deg of --goal have no effect" in check_heading("go_to_position", (1.0, 2.0, 90.0))
    assert not check_heading("go_to_position", (1.0, 2.0))


def test_a_goal_has_two_or_three_numbers():
    assert read_goal("1,-0.5") == (1.0, -0.5)
    assert read_goal("1,-0.5,90") == (1.0, -0.5, 90.0)
    for text in ("1", "1,2,3,4"):
        with pytest.raises(ConfigError, match="must be x,y,deg or x,y, in space"):
            read_goal(text)
    for text in ("1,nan", "a,b", "1,inf", "1m,2", "1,", ""):
        with pytest.raises(ConfigError, match="is no finite number"):
            read_goal(text)


def test_an_aircraft_holds_its_height_where_it_can_and_else_a_bank():
    assert default_task("a0s", "") == "fly_hold"
    assert default_task("navion", "") == "fly_attitude"  # its hull touches the water a metre above it
    assert default_task("navion", "policy") == "fly_attitude"


def test_a_robot_without_a_goal_does_the_first_of_its_usual_tasks_that_the_controller_does():
    assert default_task("leatherback", "policy") == "go_to_position"
    assert default_task("jetbot", "policy") == "go_to_position"
    assert default_task("jetbot", "classical") == "go_to_pose"
