"""Every later version answers the reference bags as they were recorded; whatever does not is named with its step."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fulmar_bags.comparison import first_difference
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.safety.input_gate import InputGate
from fulmar_core.tasks.go_to_pose import GoToPose
from fulmar_evaluation.rerun.reference_bags import LARGEST, REFERENCES, check_reference
from policy_server.policy import Policy

BAGS = Path(__file__).parent / "bags"
PLATFORM = BAGS / "floating_platform_go_to_pose_policy"


@pytest.mark.parametrize("reference", REFERENCES, ids=lambda reference: reference.name)
def test_a_reference_bag_is_answered_as_it_was_recorded(reference):
    fields = check_reference(BAGS / reference.name)
    first = first_difference(fields)
    assert first is None, (
        f"step {first.first_step}: {first.field} {first.name} was {first.recorded}, is {first.found}. "
        "If that is intended: make replay-bags"
    )
    assert {field.field for field in fields} == {"decision", "observation", "action", "command"}
    assert all(field.compared > 50 for field in fields)


def test_the_reference_bags_are_small_and_there_is_one_for_each_robot():
    assert {path.name for path in BAGS.iterdir()} == {reference.name for reference in REFERENCES}
    assert len({reference.robot for reference in REFERENCES}) == 9
    for file in BAGS.glob("*/*.mcap"):
        assert file.stat().st_size < LARGEST, file


def test_a_changed_observation_is_reported_with_its_field_and_step(monkeypatch):
    kept = GoToPose.observe

    def changed(self, state, goal):
        first, *rest = kept(self, state, goal)
        return (first * 1.001, *rest)

    monkeypatch.setattr(GoToPose, "observe", changed)
    first = first_difference(check_reference(PLATFORM))
    assert (first.field, first.name, first.first_step) == ("observation", "goal_x_in_body", 0)


def test_a_changed_action_is_reported_with_its_field_and_step(monkeypatch):
    kept = Policy.act
    count = iter(range(10_000))

    def changed(self, observation):
        command = kept(self, observation)
        if next(count) == 17:
            command = 1.0 - command
        return command

    monkeypatch.setattr(Policy, "act", changed)
    first = first_difference(check_reference(PLATFORM))
    assert (first.field, first.first_step) == ("action", 17)


def test_a_changed_limit_of_commands_is_reported(monkeypatch):
    actuators = load_robot("floating_platform").actuators
    monkeypatch.setattr(type(actuators), "limited", lambda self, command: np.zeros_like(command))
    first = first_difference(check_reference(PLATFORM))
    assert first.field == "command"


def test_a_changed_safety_decision_is_reported_with_its_step(monkeypatch):
    kept = InputGate.problem

    def stricter(self, measurement):
        far = measurement.stamp_ns > 5_000_000_000
        return "not on Sundays" if far else kept(self, measurement)

    monkeypatch.setattr(InputGate, "problem", stricter)
    first = first_difference(check_reference(PLATFORM))
    assert (first.field, first.name) == ("decision", "acted")
    assert first.first_stamp_s > 5.0


def test_a_narrower_geofence_is_reported(monkeypatch):
    import fulmar_bags.control_steps as record

    def narrow(name):
        robot = load_robot(name)
        return replace(robot, limits=replace(robot.limits, geofence=0.1))

    monkeypatch.setattr(record, "load_robot", narrow)
    first = first_difference(check_reference(PLATFORM))
    assert (first.field, first.first_step) == ("decision", 0)
