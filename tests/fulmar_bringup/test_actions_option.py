"""`--actions`: what it is refused for, before anything starts."""

from __future__ import annotations

import importlib.util

import pytest

from fulmar_bringup.node_row import Launcher
from fulmar_bringup.node_table import row_of
from fulmar_bringup.run_plan import RunPlan

find_spec = importlib.util.find_spec


def test_a_task_without_places_is_refused(fulmar) -> None:
    code, _, error = fulmar("run", "floating_platform", "--task", "track_velocities", "--actions")
    assert code == 2
    assert "task 'track_velocities' takes goals on 'goal_velocity'; an action client gives places" in error


def test_an_environment_without_the_messages_gets_the_command_that_builds_them(fulmar, monkeypatch) -> None:
    monkeypatch.setattr(
        importlib.util,
        "find_spec",
        lambda name, *more: None if name == "nav2_msgs" else find_spec(name, *more),
    )
    code, _, error = fulmar("run", "floating_platform", "--task", "go_to_pose", "--actions")
    assert code == 2
    assert "Run: fulmar install-actions" in error


def test_lock_step_has_no_action_servers(fulmar) -> None:
    code, _, error = fulmar("run", "floating_platform", "--lockstep", "--actions")
    assert code == 2
    assert "takes no --actions" in error


@pytest.mark.parametrize(("task", "topic"), [("go_to_pose", "goal_pose"), ("go_to_position", "goal_point")])
def test_the_row_publishes_the_goals_of_its_task(task: str, topic: str) -> None:
    plan = RunPlan(
        robot="floating_platform", task=task, controller="lqr", backend="mock", extras=("actions",)
    )
    row = row_of("actions")
    assert row is not None
    (spec,) = row.specs(plan, Launcher())
    assert (spec.module, spec.outputs) == ("fulmar_ros.action_node", (topic,))
    assert not list(
        row.specs(RunPlan(robot="floating_platform", task=task, controller="lqr", backend="mock"), Launcher())
    )
