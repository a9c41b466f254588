"""The last word before the actuators."""

from __future__ import annotations

import numpy as np
import pytest

from fulmar_core.robot import load_robot
from fulmar_core.safety.actuator_guard import ActuatorGuard
from fulmar_core.safety.watchdog import Watchdog

THRUSTERS = load_robot("floating_platform").actuators
NAMES = THRUSTERS.names
MS = 1_000_000
GOOD = [1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0]


@pytest.fixture
def guard():
    return ActuatorGuard(THRUSTERS, Watchdog(200 * MS))


def test_before_any_command_the_valves_are_closed(guard):
    assert not guard.output(0).any()


def test_a_good_command_is_applied_until_the_watchdog_ends_it(guard):
    assert guard.offer(NAMES, GOOD, 0)
    assert guard.output(200 * MS).tolist() == GOOD
    assert guard.output(201 * MS).tolist() == [0.0] * 8
    assert guard.watchdog.trips == 1


def test_commands_are_limited_before_they_are_applied(guard):
    guard.offer(NAMES, [0.7, -4.0, 0.2, 9.0, 0.5, 0.0, 0.0, 0.0], 0)
    assert guard.output(0).tolist() == GOOD


@pytest.mark.parametrize(
    ("names", "values", "reason"),
    [
        (NAMES[::-1], GOOD, "command names 'thruster_8' as actuator 1"),
        (NAMES[:-1], GOOD[:-1], "command names 7 actuators"),
        (NAMES, GOOD[:-1], "command has shape (7,)"),
        (NAMES, [], "command has shape (0,)"),
        (NAMES, [*GOOD[:-1], float("nan")], "command for actuator 8 is not finite"),
    ],
)
def test_a_refused_command_is_counted_and_leaves_the_last_one_in_place(guard, names, values, reason):
    guard.offer(NAMES, GOOD, 0)
    assert not guard.offer(names, values, 50 * MS)
    assert guard.output(60 * MS).tolist() == GOOD
    assert guard.rejected == 1
    assert reason in guard.last_rejection


def test_a_refused_command_does_not_feed_the_watchdog(guard):
    guard.offer(NAMES, GOOD, 0)
    for t in range(10, 300, 10):
        guard.offer(NAMES, [float("nan")] * 8, t * MS)
    assert not guard.output(300 * MS).any()
    assert guard.watchdog.tripped


def test_after_a_silence_the_old_command_does_not_come_back(guard):
    guard.offer(NAMES, GOOD, 0)
    assert not guard.output(500 * MS).any()
    guard.offer(NAMES, [float("nan")] * 8, 510 * MS)
    assert not guard.output(511 * MS).any()
    guard.offer(NAMES, GOOD[::-1], 520 * MS)
    assert guard.output(521 * MS).tolist() == GOOD[::-1]


def test_what_the_caller_does_with_his_list_later_does_not_matter(guard):
    values = np.array(GOOD)
    guard.offer(NAMES, values, 0)
    values[:] = 1.0
    assert guard.output(1).tolist() == GOOD


def test_a_command_older_than_the_last_is_refused_and_does_not_feed_the_watchdog(guard):
    assert guard.offer(NAMES, GOOD, 0, stamp_ns=5000 * MS)
    assert not guard.offer(NAMES, GOOD[::-1], 150 * MS, stamp_ns=4980 * MS)
    assert "20 ms" in guard.last_rejection
    assert guard.output(150 * MS).tolist() == GOOD
    assert not guard.output(201 * MS).any()


def test_a_command_as_old_as_the_last_is_taken(guard):
    assert guard.offer(NAMES, GOOD, 0, stamp_ns=5000 * MS)
    assert guard.offer(NAMES, GOOD[::-1], 1, stamp_ns=5000 * MS)


@pytest.mark.parametrize("unset", [0, None])
def test_a_command_that_nobody_stamped_is_taken_and_opens_no_way_back(guard, unset):
    assert guard.offer(NAMES, GOOD, 0, stamp_ns=5000 * MS)
    assert guard.offer(NAMES, GOOD, 1, stamp_ns=unset)
    assert not guard.offer(NAMES, GOOD, 2, stamp_ns=4000 * MS)


def test_the_stamp_of_a_refused_command_does_not_count(guard):
    guard.offer(NAMES, GOOD[:-1], 0, stamp_ns=9000 * MS)
    assert guard.offer(NAMES, GOOD, 0, stamp_ns=5000 * MS)


def test_after_a_reset_actuators_are_safe_without_a_trip_and_stamps_may_start_anew(guard):
    guard.offer(NAMES, GOOD, 0, stamp_ns=5000 * MS)
    guard.reset()
    assert not guard.output(1).any()
    assert not guard.output(900 * MS).any()
    assert guard.watchdog.trips == 0
    assert guard.offer(NAMES, GOOD, 901 * MS, stamp_ns=1000 * MS)
    assert guard.output(902 * MS).tolist() == GOOD


def test_a_stray_stamp_from_the_future_locks_nobody_out_beyond_one_trip(guard):
    assert guard.offer(NAMES, GOOD, 0, stamp_ns=9_000_000 * MS)
    assert not guard.offer(NAMES, GOOD, 100 * MS, stamp_ns=5000 * MS)
    assert not guard.output(10_000 * MS).any()
    assert guard.offer(NAMES, GOOD, 10_001 * MS, stamp_ns=5000 * MS)


WHEELS = load_robot("turtlebot2").actuators  # may change by 0.9 m/s and 1.8 rad/s a second


def test_wheels_slow_down_as_fast_as_they_may_when_commands_stop():
    guard = ActuatorGuard(WHEELS, Watchdog(200 * MS))
    assert guard.offer(WHEELS.names, [0.36, -0.9], 0)
    assert guard.output(200 * MS) == pytest.approx([0.36, -0.9])
    assert guard.output(300 * MS) == pytest.approx([0.27, -0.72])
    assert guard.output(650 * MS) == pytest.approx([0.0, -0.09])
    assert guard.output(800 * MS).tolist() == [0.0, 0.0]


def test_wheels_that_were_told_to_stop_stay_still_when_commands_stop():
    guard = ActuatorGuard(WHEELS, Watchdog(200 * MS))
    guard.offer(WHEELS.names, [0.0, 0.0], 0)
    assert not guard.output(210 * MS).any()


def test_propellers_stop_at_once_when_commands_stop():
    propellers = load_robot("kingfisher").actuators
    guard = ActuatorGuard(propellers, Watchdog(200 * MS))
    guard.offer(propellers.names, [1.0, -0.5], 0)
    assert not guard.output(201 * MS).any()
