"""What a run is said to have come to, from its bag and from how its processes ended."""

from __future__ import annotations

from pathlib import Path

import pytest

from fulmar_bringup.processes import Ended
from fulmar_bringup.run_executor import Execution, with_ends
from fulmar_bringup.run_plan import RunPlan
from fulmar_evaluation.run_outcome import RunOutcome, evaluate_execution
from tests.synthetic_run import Plan, write_run


def outcome(bag: Path, failure: str = "", more_steps: int = 0) -> RunOutcome:
    """Of a run in lock step whose plant had so many more commands than its bag."""
    plan = RunPlan("floating_platform", "go_to_pose", "lqr", "mock", 5.0, lockstep=True, record=str(bag))
    steps = evaluate_execution(plan, Execution("", 0)).summary["steps"]
    return evaluate_execution(plan, Execution(failure, steps + more_steps))


def test_a_run_that_met_its_goal_is_exit_code_zero(reached):
    found = outcome(reached)
    assert (found.summary["success"], found.failure, found.exit_code) == (True, "", 0)


def test_a_missed_goal_is_exit_code_one_and_no_failure(tmp_path):
    found = outcome(write_run(tmp_path / "bag", Plan(duration_s=2.0)))
    assert (found.summary["success"], found.summary["failure"], found.exit_code) == (False, None, 1)


def test_commands_that_are_not_in_the_bag_fail_a_run_in_lock_step(reached):
    found = outcome(reached, more_steps=3)
    assert found.failure == f"the bag lacks 3 of {found.summary['steps'] + 3} commands"
    assert (found.summary["failure"], found.exit_code) == (found.failure, 1)


def test_a_run_without_a_bag_has_an_outcome_all_the_same(tmp_path):
    failure = "recorder ended with exit code 2 before the run was over"
    found = outcome(tmp_path / "bag", failure)
    assert (found.failure, found.exit_code) == (failure, 1)
    assert (found.summary["robot"], found.summary["controller"]) == ("floating_platform", "lqr")
    assert [found.summary[key] for key in ("success", "bag", "final_position_error_m")] == [False, None, None]


@pytest.mark.parametrize(
    ("failure", "said"),
    [
        ("", "recorder ended with exit code 1 when it was stopped"),
        ("stopped by SIGINT", "stopped by SIGINT; recorder ended with exit code 1 when it was stopped"),
        ("recorder ended with exit code 2", "recorder ended with exit code 2"),
    ],
)
def test_a_recorder_that_fails_at_its_end_fails_the_run(failure, said):
    """A full disk is reported by the recorder's exit code alone, when all else went well."""
    assert with_ends(failure, [Ended("controller", 0), Ended("recorder", 1)]) == said
