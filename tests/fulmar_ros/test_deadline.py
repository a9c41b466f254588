"""Absolute deadlines: steady, honest about lateness, never a burst."""

from __future__ import annotations

import os
import threading
import time

import pytest

from fulmar_core.config.process import (
    CONTROL_PRIORITY,
    PLANT_PRIORITY,
    give_up_priority,
    take_priority,
    take_priority_with_helpers,
)
from fulmar_ros.deadline import Deadlines, Spread


class FakeClock:
    """A monotonic clock that moves only when somebody sleeps or works."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now_ns = 1_000_000_000
        monkeypatch.setattr(time, "monotonic_ns", lambda: self.now_ns)
        monkeypatch.setattr(time, "sleep", self.work)

    def work(self, seconds: float) -> None:
        self.now_ns += round(max(seconds, 1e-5) * 1e9)  # even letting others pass takes its time


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> FakeClock:
    return FakeClock(monkeypatch)


def beats(deadlines: Deadlines, clock: FakeClock, work_s: list[float]) -> list[float]:
    """Times of the beats, relative to the first, with some work after each [s]."""
    times = []
    for seconds in work_s:
        assert deadlines.wait(threading.Event())
        times.append(clock.now_ns / 1e9)
        clock.work(seconds)
    return [round(each - times[0], 9) for each in times]


def test_work_shorter_than_the_period_does_not_shift_the_beat(clock):
    assert beats(Deadlines(0.02), clock, [0.001, 0.019, 0.0, 0.01]) == [0.0, 0.02, 0.04, 0.06]


def test_missed_deadlines_are_counted_and_skipped_not_made_up_for(clock):
    deadlines = Deadlines(0.02)
    assert beats(deadlines, clock, [0.05, 0.0, 0.0]) == [0.0, 0.05, 0.06]
    assert deadlines.overruns == 1


def test_the_period_error_is_the_distance_from_the_nominal_period(clock):
    deadlines = Deadlines(0.02)
    beats(deadlines, clock, [0.03, 0.0])
    assert float(deadlines.period_error_ms.percentiles("e")["e_max"]) == pytest.approx(10.0)


def test_aligned_deadlines_beat_at_the_anchor_and_whole_periods_after_it(clock):
    deadlines = Deadlines(0.02)
    first = clock.now_ns
    assert deadlines.wait(threading.Event())
    deadlines.align(first + 7_000_000)
    times = []
    for _ in range(4):
        assert deadlines.wait(threading.Event())
        times.append((clock.now_ns - first) / 1e9)
    assert times == pytest.approx([0.02, 0.027, 0.047, 0.067])
    assert float(deadlines.period_error_ms.percentiles("e")["e_max"]) == pytest.approx(0.0)


def test_a_set_stop_ends_the_beat(clock):
    stop = threading.Event()
    stop.set()
    assert not Deadlines(0.02).wait(stop)


def test_a_spread_without_samples_says_nothing():
    assert Spread().percentiles("x") == {"x_p50": "", "x_p99": "", "x_max": ""}


def test_the_plant_interrupts_a_controller_that_spins_and_never_the_other_way_round():
    assert PLANT_PRIORITY > CONTROL_PRIORITY


def test_only_the_calling_thread_takes_priority():
    found = {}

    def look() -> None:
        if take_priority(CONTROL_PRIORITY):
            found["own"] = (os.sched_getscheduler(0), os.sched_getparam(0).sched_priority)

    thread = threading.Thread(target=look)
    thread.start()
    thread.join()
    assert os.sched_getscheduler(0) == os.SCHED_OTHER
    assert found.get("own", (os.SCHED_FIFO, CONTROL_PRIORITY)) == (os.SCHED_FIFO, CONTROL_PRIORITY)


def test_threads_that_messages_pass_take_priority_too_and_the_main_one_does_not():
    over = threading.Event()
    helper = threading.Thread(target=over.wait)
    helper.start()
    may: list[bool] = []

    def lead() -> None:
        may.append(take_priority(CONTROL_PRIORITY))
        take_priority_with_helpers(CONTROL_PRIORITY)

    thread = threading.Thread(target=lead)
    thread.start()
    thread.join()
    assert helper.native_id is not None
    policy = os.sched_getscheduler(helper.native_id)
    over.set()
    helper.join()
    assert policy == (os.SCHED_FIFO if may[0] else os.SCHED_OTHER)
    assert os.sched_getscheduler(0) == os.SCHED_OTHER


def test_a_thread_that_gives_up_its_priority_is_an_ordinary_one():
    found: list[int] = []

    def work() -> None:
        take_priority(CONTROL_PRIORITY)
        give_up_priority()
        found.append(os.sched_getscheduler(0))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert found == [os.SCHED_OTHER]
