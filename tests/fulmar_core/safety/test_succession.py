"""Whose turn it is."""

from __future__ import annotations

import pytest

from fulmar_core.safety.command_gate import REJECTIONS_TO_LATCH
from fulmar_core.safety.fallback import ControllerSwitch


def reject(switch, times=REJECTIONS_TO_LATCH):
    return [switch.note("it is not finite") for _ in range(times)][-1]


def test_a_controller_that_was_refused_gives_its_place_to_the_fallback_with_the_reason():
    line = ControllerSwitch(None, "lqr", refused="wrong hash")
    assert (line.current, line.fell_back) == ("lqr", "wrong hash")


def test_without_both_there_is_nothing_to_begin_with():
    with pytest.raises(ValueError, match="neither"):
        ControllerSwitch(None, None)


def test_rejections_in_a_row_bring_the_fallback_and_no_fault():
    line = ControllerSwitch("policy", "lqr")
    assert reject(line, REJECTIONS_TO_LATCH - 1) is None
    assert line.current == "policy"
    assert reject(line, 1) is None
    assert line.current == "lqr"
    assert "refused" in line.fell_back


def test_a_good_command_in_between_begins_the_count_anew():
    line = ControllerSwitch("policy", "lqr")
    for _ in range(5):
        reject(line, REJECTIONS_TO_LATCH - 1)
        line.note(None)
    assert line.current == "policy"


def test_a_fallback_that_fails_too_is_a_fault():
    line = ControllerSwitch("policy", "lqr")
    reject(line)
    assert "refused" in reject(line)
    assert line.rejections == 2 * REJECTIONS_TO_LATCH


def test_without_a_fallback_rejections_are_a_fault():
    assert reject(ControllerSwitch("policy"))


def test_a_candidate_takes_over_at_the_next_turn_and_not_before():
    line = ControllerSwitch("old")
    line.propose("new")
    assert line.current == "old"
    assert line.apply()
    assert line.current == "new"
    assert not line.apply()


def test_a_candidate_brings_a_count_of_its_own_and_ends_the_fallback():
    line = ControllerSwitch("old", "lqr")
    reject(line)
    line.propose("new")
    line.apply()
    assert (line.current, line.fell_back) == ("new", "")
    reject(line)
    assert line.current == "lqr"
