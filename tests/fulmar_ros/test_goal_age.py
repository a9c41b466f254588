"""Goals that were published before the e-stop was reset."""

from __future__ import annotations

import time

from fulmar_ros.goal_age import BEFORE_RESET, GoalAge


def published(time_ns: int) -> dict[str, int]:
    """Info of a message."""
    return {"source_timestamp": time_ns}


def test_a_goal_from_before_the_start_or_the_newest_reset_is_too_old():
    before = time.time_ns()
    age = GoalAge(counts=True)
    assert age.problem(published(before)) == BEFORE_RESET
    between = time.time_ns()
    assert age.problem(published(between)) == ""
    age.reset()
    assert age.problem(published(between)) == BEFORE_RESET
    assert age.problem(published(time.time_ns())) == ""


def test_no_goal_is_too_old_where_a_person_started_the_robot():
    assert GoalAge(counts=False).problem(published(0)) == ""
