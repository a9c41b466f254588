"""Start of goals: at once, at a time sent ahead, or never because another goal came."""

from __future__ import annotations

import pytest

from fulmar_core.loop.mission import LONGEST_AHEAD_NS, Schedule

S = 1_000_000_000


def given(*items: tuple[str, int]) -> Schedule[str]:
    schedule: Schedule[str] = Schedule()
    for name, stamp_ns in items:
        schedule.give(name, stamp_ns)
    return schedule


def test_nothing_goes_on_before_something_has_begun():
    assert Schedule().at(5 * S) is None
    assert given(("later", 7 * S)).at(5 * S) is None


@pytest.mark.parametrize("stamp_ns", [0, 3 * S, 5 * S, 5 * S + LONGEST_AHEAD_NS + 1])
def test_a_stamp_of_the_past_or_of_another_clock_means_at_once(stamp_ns):
    assert given(("now", stamp_ns)).at(5 * S) == "now"


def test_goals_sent_ahead_begin_one_after_another():
    schedule = given(("one", 5 * S), ("two", 6 * S), ("three", 8 * S))
    assert [schedule.at(round(t * S)) for t in (5, 5.9, 6, 7.9, 8, 99)] == [
        "one", "one", "two", "two", "three", "three",
    ]  # fmt: skip


def test_what_is_passed_over_does_not_come_back():
    assert given(("one", 5 * S), ("two", 6 * S)).at(7 * S) == "two"


def test_something_new_takes_the_place_of_all_that_would_have_come_after_it():
    schedule = given(("one", 5 * S), ("two", 6 * S))
    assert schedule.at(5 * S) == "one"
    schedule.give("stop", 0)
    assert [schedule.at(t * S) for t in (5, 6, 7)] == ["stop"] * 3


def test_what_was_to_come_before_something_new_still_comes():
    schedule = given(("one", 5 * S), ("two", 6 * S))
    assert schedule.at(5 * S) == "one"
    schedule.give("three", 7 * S)
    assert [schedule.at(t * S) for t in (5, 6, 7)] == ["one", "two", "three"]


def test_seconds_that_were_rounded_make_no_difference():
    assert given(("one", 0), ("two", 6 * S + 10)).at(6 * S) == "two"
