"""What programs say of themselves on `operator/action`, and what is not believed."""

from __future__ import annotations

import json

import pytest

from fulmar_core.wires.operator_action import GOAL, LONGEST, OperatorAction, read_action


def test_an_action_is_read_as_it_was_written():
    action = OperatorAction("/console on lab", GOAL, 1_700_000_000_123_456_789)
    assert read_action(action.to_text()) == action


@pytest.mark.parametrize(
    "text",
    [
        "", "{", "[]", "1", "null",
        json.dumps({"by": "a", "does": "dance"}),
        json.dumps({"by": "", "does": "goal"}),
        json.dumps({"by": "a\nb", "does": "goal"}),
        json.dumps({"by": 3, "does": "goal"}),
        json.dumps({"by": "a" * (LONGEST + 1), "does": "goal"}),
        json.dumps({"by": "a", "does": "goal", "stamp_ns": "1"}),
        json.dumps({"by": "a", "does": "goal", "stamp_ns": True}),
        json.dumps({"by": "a", "does": "goal", "more": "x" * 2000}),
        "[" * 700,
    ],
)  # fmt: skip
def test_what_is_no_action_is_left_out(text):
    assert read_action(text) is None
