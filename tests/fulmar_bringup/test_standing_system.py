"""A system without an end: its plan, its ending, and the line that shows how it is."""

from __future__ import annotations

import io
from dataclasses import replace

import pytest
from rich.console import Console

from fulmar_bringup.completion import completed
from fulmar_bringup.plan_checks import checked
from fulmar_bringup.progress import live_line
from fulmar_bringup.run_executor import Execution
from fulmar_bringup.standing_system import Ending, keep_up
from fulmar_bringup.system_plan import system_plan
from fulmar_core.config.errors import ConfigError, UnknownNameError


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
