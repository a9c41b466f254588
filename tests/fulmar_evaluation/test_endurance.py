"""What counts as safe of a robot with a broken part: it is said in time, and the robot stops or copes."""

from __future__ import annotations

import time
from types import SimpleNamespace

import pytest

from fulmar_core.robots.wire_check import BETWEEN, WARNINGS
from fulmar_evaluation.faults import endurance
from fulmar_evaluation.faults.endurance import complaint, endured
from fulmar_evaluation.faults.observer import HealthStatus

WORDS = "thruster_3 is stuck open"


@pytest.fixture(autouse=True)
def no_waiting(monkeypatch) -> None:
    monkeypatch.setattr(endurance, "AFTER_S", 0.0)
    monkeypatch.setattr(endurance, "wait_for", lambda condition, _timeout_s: condition())


def system(since_s, *, statuses=(), moves=True):
    """A system of which nothing but statuses and applied commands is known; the newest of these came just now."""
    applied = [(since_s, True), (since_s + 2.0, moves)]
    observer = SimpleNamespace(
        statuses_since=lambda from_s: [each for each in statuses if each.received_s >= from_s],
        applied_since=lambda from_s: [each for each in applied if each[0] >= from_s],
    )
    return SimpleNamespace(observer=observer, has_ended=False, flight=None)


def distance(*numbers):
    """A watch that reads these distances one after the other, and then the last one."""
    left = list(numbers)

    class Watch:
        near, astray = 0.3, 0.5

        @property
        def newest(self):
            return left.pop(0) if len(left) > 1 else left[0]

    return Watch()


def said(received_s, words=WORDS, *, warning=False):
    values = {WARNINGS: BETWEEN.join(("another", words))} if warning else {}
    return HealthStatus(
        received_s, "controller", "ok" if warning else "error", "active" if warning else words, values
    )


@pytest.fixture
def since_s():
    return time.monotonic() - 10.0


def test_what_nobody_said_is_not_endured_unless_the_robot_is_at_its_goal(since_s):
    assert not endured(system(since_s), since_s, 5.0, distance(2.0)).passed
    assert endured(system(since_s), since_s, 5.0, distance(0.1)).passed


@pytest.mark.parametrize("warning", [False, True], ids=["as a problem", "as a warning"])
def test_a_robot_that_stopped_after_it_was_said_is_safe_from_then_on(since_s, warning):
    live = system(since_s, statuses=[said(since_s + 1.0, warning=warning)], moves=False)
    outcome = endured(live, since_s, 5.0, distance(2.0))
    assert outcome.passed
    assert outcome.detected_by == "controller"
    assert WORDS in outcome.reaction or warning
    assert outcome.time_to_safe_s == pytest.approx(2.0)


def test_a_robot_that_goes_on_may_not_go_astray(since_s):
    live = system(since_s, statuses=[said(since_s + 1.0)])
    assert endured(live, since_s, 5.0, distance(2.0, 2.0, 2.1)).passed
    assert not endured(live, since_s, 5.0, distance(2.0, 2.0, 3.0)).passed


def test_another_part_than_the_broken_one_is_no_answer(since_s):
    live = system(since_s, statuses=[said(since_s + 1.0)], moves=False)
    assert endured(live, since_s, 5.0, distance(2.0), lambda words: "thruster_3" in words).passed
    assert not endured(live, since_s, 5.0, distance(2.0), lambda words: "thruster_4" in words).passed


def test_what_was_said_before_the_fault_is_no_answer(since_s):
    live = system(since_s, statuses=[said(since_s - 1.0), said(since_s + 1.0)])
    assert complaint(live, since_s, bool) is None
