"""Only commands that can be carried out pass; several refusals in a row stay."""

from __future__ import annotations

import numpy as np
import pytest

from fulmar_core.safety.command_gate import REJECTIONS_TO_LATCH, Rejections, command_problem, name_problem


@pytest.mark.parametrize("values", [[0.0, 1.0, 0.0], [-7.0, 1e9, 0.5]])
def test_finite_values_of_the_right_number_pass(values):
    assert command_problem(np.array(values), (3,)) is None


@pytest.mark.parametrize("shape", [(), (2,), (4,), (1, 3), (3, 1), (0,)])
def test_every_other_shape_is_refused(shape):
    assert command_problem(np.zeros(shape), (3,)) == f"command has shape {shape}, must be (3,)"


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_value_that_is_not_finite_is_refused_with_its_actuator(value):
    assert command_problem(np.array([0.0, value, 0.0]), (3,)) == "command for actuator 2 is not finite"


def test_commands_of_many_robots_are_checked_together():
    commands = np.zeros((2, 3))
    assert command_problem(commands, (2, 3)) is None
    assert command_problem(commands, (1, 3)) == "command has shape (2, 3), must be (1, 3)"
    commands[1, 2] = np.nan
    assert command_problem(commands, (2, 3)) == "command for actuator 3 is not finite"


@pytest.mark.parametrize(
    ("names", "reason"),
    [
        (["a", "b"], None),
        (["b", "a"], "command names 'b' as actuator 1, must be 'a'"),
        (["a", "c"], "command names 'c' as actuator 2, must be 'b'"),
        (["a"], "command names 1 actuators, must name 2"),
        ([], "command names 0 actuators, must name 2"),
    ],
)
def test_names_have_to_be_the_robots_in_its_order(names, reason):
    assert name_problem(names, ("a", "b")) == reason


def test_a_name_that_is_none_is_not_quoted_whole():
    problem = name_problem(("a", "b" * 1_000_000), ("a", "b"))
    assert problem is not None
    assert "as actuator 2, must be 'b'" in problem
    assert len(problem) < 200


def test_names_that_are_too_many_are_not_looked_at():
    class Many(tuple):
        def __len__(self) -> int:
            return 10**9

        def __iter__(self):
            raise AssertionError("copied")

    assert name_problem(Many(), ("a", "b")) == "command names 1000000000 actuators, must name 2"


def test_refusals_in_a_row_latch_with_the_last_reason():
    rejections = Rejections()
    assert [rejections.note("x") for _ in range(REJECTIONS_TO_LATCH - 1)] == [None] * (
        REJECTIONS_TO_LATCH - 1
    )
    assert rejections.note("it is NaN") == "3 commands in a row were refused, the last because it is NaN"


def test_one_good_command_breaks_the_row_but_not_the_total():
    rejections = Rejections(to_latch=2)
    results = [rejections.note(reason) for reason in ("x", None, "x", None, "x")]
    assert results == [None] * 5
    assert rejections.total == 3
