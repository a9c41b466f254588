"""A system without an end: its plan, its ending, and the line that shows how it is."""

from __future__ import annotations

import io
from dataclasses import replace

import pytest
from rich.console import Console

from fulmar_bringup.completion import completed
from fulmar_bringup.launched_system import list_nodes
from fulmar_bringup.plan_checks import checked
from fulmar_bringup.progress import live_line
from fulmar_bringup.run_executor import Execution
from fulmar_bringup.standing_system import Ending, keep_up
from fulmar_bringup.system_plan import system_plan
from fulmar_bringup.system_rows import system_rows
from fulmar_core.config.errors import ConfigError, UnknownNameError
from fulmar_core.config.paths import config_names
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks import load_task
from policy_server.controllers import usual_controller, usual_hz


@pytest.fixture
def plan(tmp_path):
    """Function that plans a system."""

    def planned(system="mujoco_lqr", *, changes=None, **more):
        asked = replace(system_plan(system, **(changes or {})), record=str(tmp_path / "bag"), **more)
        return checked(completed(asked))

    return planned


def test_a_system_has_no_end_and_begins_at_the_origin(plan):
    planned = plan()
    assert (planned.duration_s, planned.start, planned.control_hz) == (0.0, (0.0, 0.0, 0.0), 50.0)
    assert plan(start=(1.0, 2.0, 90.0)).start == (1.0, 2.0, 90.0)


def test_a_system_keeps_the_name_of_its_robot(plan):
    assert plan().robot_name == "floating_platform"
    assert plan(changes={"name": "alpha"}).namespace == "/alpha"
    with pytest.raises(ConfigError, match="the name '' of a robot"):
        plan(changes={"name": ""})


@pytest.mark.parametrize("robot", config_names("robots"))
def test_a_robot_without_a_system_does_what_it_usually_does_and_waits_for_goals_where_it_takes_some(
    plan, robot
):
    planned, kind = plan(None, changes={"robot": robot}), load_robot(robot).kind
    usual = usual_controller(load_robot(robot), load_task(planned.task))
    assert planned.backend == "mujoco" and planned.controller == usual
    assert planned.task in (kind.goal_task, kind.usual_task, kind.other_task)
    assert planned.task != "point"  # which takes no goals
    assert planned.standing and planned.robot == robot
    assert planned.start[2] > 0.0 or kind.stays  # in the air
    rows = system_rows(planned, record={"directory": "", "info": "{}", "files": "{}"})
    assert rows["controller"].parameters["controller"] == planned.controller


def test_a_launch_of_a_robot_without_a_system_starts_what_it_usually_does():
    controller = next(row for row in list_nodes(robot="cubesat_wheels") if row.name == "controller")
    assert controller.parameters["task"] == "slew"


def test_a_robot_in_the_place_of_a_system_s_keeps_its_task_and_controller(plan):
    planned = plan("mujoco_lqr", changes={"robot": "modular_freeflyer"})
    assert (planned.task, planned.controller) == ("go_to_pose", "lqr")
    assert plan(None).robot == plan("mujoco_policy").robot == "floating_platform"
    chosen = plan(
        None, changes={"robot": "spacecraft_16", "task": "go_to_position_3d", "controller": "policy"}
    )
    assert (chosen.task, chosen.controller) == ("go_to_position_3d", "policy")


@pytest.mark.parametrize(("system", "robot"), [
    ("mujoco_spacecraft", "spacecraft_16"), ("mujoco_satellite", "cubesat_wheels"), ("mujoco_aircraft", "airship_v7"),
])  # fmt: skip
def test_there_is_a_system_for_space_for_satellites_and_for_aircraft(plan, system, robot):
    planned = plan(system)
    assert planned.robot == robot
    assert planned.control_hz == usual_hz(planned.controller, load_robot(robot), load_task(planned.task))


def test_on_hardware_goals_come_later_and_an_e_stop_runs(plan):
    planned = plan(changes={"robot": "turtlebot2", "task": "go_to_position", "controller": "classical",
                            "backend": "hardware"})  # fmt: skip
    assert planned.hardware.endswith("turtlebot2.yaml")
    assert planned.guards.estop


def test_velocities_get_no_bag_for_each_goal(plan):
    assert plan(recording_mode="goals").recording.mode == "goals"
    with pytest.raises(ConfigError, match="velocities stream"):
        plan(changes={"task": "track_velocities"}, recording_mode="goals")
    with pytest.raises(UnknownNameError, match="Did you mean 'goals'"):
        plan(recording_mode="goal")


@pytest.mark.parametrize(
    ("reason", "failure"),
    [
        ("stopped by the user", ""),
        ("stopped by SIGTERM", ""),  # while the nodes still start
        ("stopped by SIGTERM; recorder ended with exit code 1 when it was stopped",) * 2,
        ("controller was killed by SIGKILL before the run was over",) * 2,
    ],
)
def test_a_system_that_is_stopped_has_not_failed(reason, failure, monkeypatch):
    monkeypatch.setattr("fulmar_bringup.standing_system.run_nodes", lambda *_: Execution(reason, 0))
    assert keep_up(None, None, None) == Ending(failure, None)


@pytest.mark.parametrize("terminal", [True, False])
def test_the_live_line_is_for_terminals_alone(terminal, monkeypatch):
    screen = io.StringIO()
    monkeypatch.setattr(
        "fulmar_bringup.progress.console", Console(file=screen, force_terminal=terminal, width=80)
    )
    with live_line() as show:
        show(12.3, 0.42, "active")
    assert ("12.3 s  active, 0.42 m from the goal" in screen.getvalue()) == terminal
