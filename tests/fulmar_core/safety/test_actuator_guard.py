"""The last word before the actuators."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st

from fulmar_core.robots.robot_file import load_robot
from fulmar_core.safety.actuator_guard import ActuatorGuard
from fulmar_core.safety.watchdog import Watchdog
from tests.fulmar_core.safety.guards import BASE, GOOD, MS, NAMES, THRUSTERS


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


def test_what_was_left_in_a_queue_opens_no_valve_after_a_trip(guard):
    assert guard.offer(NAMES, GOOD, 0, stamp_ns=9000 * MS)
    assert not guard.output(300 * MS).any()
    assert guard.watchdog.tripped
    assert not guard.offer(NAMES, GOOD, 301 * MS, stamp_ns=5000 * MS)
    assert not guard.output(302 * MS).any()


def test_an_answer_to_what_is_older_than_the_watchdog_opens_no_valve_and_does_not_feed_it(guard):
    assert not guard.offer(NAMES, GOOD, 0, stamp_ns=5000 * MS, outdated=True)
    assert "older than the watchdog's 200 ms" in guard.last_rejection
    assert not guard.output(1).any()
    assert guard.watchdog.silent_ns(1) == 0


def test_the_safe_command_is_taken_at_once_however_old_what_it_answers_is(guard):
    """A controller whose sensor fell silent answers the last that it saw: then the valves close, no later."""
    assert guard.offer(NAMES, GOOD, 0, stamp_ns=5000 * MS)
    assert guard.offer(NAMES, [0.0] * 8, 150 * MS, stamp_ns=5000 * MS, outdated=True)
    assert not guard.output(151 * MS).any()
    assert not guard.offer(NAMES, GOOD, 152 * MS, stamp_ns=5000 * MS, outdated=True)


def test_in_lock_step_no_answer_is_too_old_since_time_stands_still():
    guard = ActuatorGuard(THRUSTERS, Watchdog(200 * MS), lockstep=True)
    assert guard.offer(NAMES, GOOD, 0, stamp_ns=5000 * MS, outdated=True)


def test_in_lock_step_a_slow_answer_is_no_trip_of_the_watchdog():
    guard = ActuatorGuard(THRUSTERS, Watchdog(200 * MS), lockstep=True)
    assert guard.offer(NAMES, GOOD, 0, stamp_ns=5000 * MS)
    assert guard.offer(NAMES, GOOD, 900 * MS, stamp_ns=5100 * MS)
    assert not guard.watchdog.tripped
    assert guard.watchdog.trips == 0


WHEELS = load_robot("turtlebot2").actuators  # may change by 0.9 m/s and 1.8 rad/s a second


def test_wheels_slow_down_as_fast_as_they_may_when_commands_stop():
    guard = ActuatorGuard(WHEELS, Watchdog(200 * MS))
    assert guard.offer(WHEELS.names, [0.36, -0.9], 0)
    assert guard.output(200 * MS) == pytest.approx([0.36, -0.9])
    assert guard.output(300 * MS) == pytest.approx([0.27, -0.72])
    assert guard.output(650 * MS) == pytest.approx([0.0, -0.09])
    assert guard.output(800 * MS).tolist() == [0.0, 0.0]


def test_wheels_that_were_commanded_to_stop_stay_still_when_commands_stop():
    guard = ActuatorGuard(WHEELS, Watchdog(200 * MS))
    guard.offer(WHEELS.names, [0.0, 0.0], 0)
    assert not guard.output(210 * MS).any()


def test_propellers_stop_at_once_when_commands_stop():
    propellers = load_robot("kingfisher").actuators
    guard = ActuatorGuard(propellers, Watchdog(200 * MS))
    guard.offer(propellers.names, [1.0, -0.5], 0)
    assert not guard.output(201 * MS).any()


class TestEstop:
    """The e-stop goes before everything."""

    def test_it_closes_the_valves_at_once_and_takes_no_command(self, guard):
        guard.estop.receive(False, 0)
        guard.offer(NAMES, GOOD, 0)
        assert guard.output(1).any()
        guard.estop.receive(True, 2)
        assert not guard.output(3).any()
        guard.offer(NAMES, GOOD, 4)
        assert not guard.output(5).any()

    def test_its_silence_does_the_same(self, guard):
        guard.estop.receive(False, 0)
        for t in range(0, 1000, 50):
            guard.offer(NAMES, GOOD, t * MS)
        assert not guard.output(1000 * MS).any()

    def test_after_a_release_only_a_new_command_opens_a_valve(self, guard):
        guard.estop.receive(True, 0)
        guard.offer(NAMES, GOOD, 1)
        guard.estop.receive(False, 400 * MS)
        guard.estop.release(600 * MS)
        assert not guard.output(601 * MS).any()
        guard.offer(NAMES, GOOD, 602 * MS)
        assert guard.output(603 * MS).tolist() == GOOD

    def test_it_holds_in_lock_step_too(self, guard):
        guard.offer(NAMES, GOOD, 0)
        assert guard.answer(900 * MS).tolist() == GOOD  # time stands still there
        guard.estop.receive(True, 900 * MS)
        assert not guard.answer(901 * MS).any()

    def test_a_person_is_stopped_like_a_controller(self, guard):
        guard.offer_by_hand(NAMES, GOOD, 0)
        guard.estop.receive(True, 1)
        assert not guard.output(2).any()


class TestHand:
    """A person goes before the controller, until the person gives back."""

    def test_a_hand_takes_the_actuators_from_the_controller(self, guard):
        guard.offer(NAMES, GOOD, 0)
        assert guard.offer_by_hand(NAMES, GOOD[::-1], 1)
        assert not guard.offer(NAMES, GOOD, 2)
        assert guard.output(3).tolist() == GOOD[::-1]

    def test_a_hand_that_falls_silent_closes_the_valves_and_the_controller_stays_out(self, guard):
        guard.offer_by_hand(NAMES, GOOD, 0)
        for t in range(0, 500, 20):
            guard.offer(NAMES, GOOD, t * MS)
        assert not guard.output(500 * MS).any()

    def test_it_is_given_back_only_when_the_hand_has_let_go(self, guard):
        guard.offer_by_hand(NAMES, GOOD, 0)
        assert "still moves" in guard.give_back(1)
        guard.offer_by_hand(NAMES, [0.0] * 8, 2)
        assert guard.give_back(3) == ""
        assert guard.offer(NAMES, GOOD, 4)
        assert guard.output(5).tolist() == GOOD

    def test_the_last_word_of_a_hand_that_comes_late_takes_nothing_back(self, guard):
        guard.offer_by_hand(NAMES, [0.0] * 8, 0)
        guard.give_back(1)
        assert not guard.offer_by_hand(NAMES, [0.0] * 8, 100 * MS)
        assert not guard.person
        assert guard.offer_by_hand(NAMES, GOOD, 110 * MS)  # one that moves the robot does, at once
        assert guard.person

    def test_a_hand_at_rest_takes_the_robot_once_the_last_words_are_over(self, guard):
        guard.offer_by_hand(NAMES, [0.0] * 8, 0)
        guard.give_back(1)
        assert guard.offer_by_hand(NAMES, [0.0] * 8, 300 * MS)

    def test_a_senseless_hand_takes_nothing(self, guard):
        assert not guard.offer_by_hand(NAMES, [float("nan")] * 8, 0)
        assert not guard.person

    def test_nobody_gives_back_what_nobody_has(self, guard):
        assert guard.give_back(0)


class TestRefusingDevice:
    """A device that says that it does not do what it is commanded."""

    def test_it_is_held_safe_also_after_it_obeys_again(self, guard):
        guard.offer(NAMES, GOOD, 0)
        guard.see_refusal("mode HOLD")
        assert not guard.output(1 * MS).any()
        guard.see_refusal("")
        guard.offer(NAMES, GOOD, 10 * MS)
        assert not guard.output(11 * MS).any()
        assert guard.held == "mode HOLD"

    def test_a_person_gives_control_back_once_it_obeys(self, guard):
        guard.see_refusal("mode HOLD")
        assert guard.give_back(0) == "refused: mode HOLD"
        guard.see_refusal("")
        assert guard.give_back(1) == ""
        assert guard.offer(NAMES, GOOD, 2)
        assert guard.output(3).tolist() == GOOD

    def test_a_hand_does_not_move_it_either(self, guard):
        guard.see_refusal("mode HOLD")
        guard.offer_by_hand(NAMES, GOOD, 0)
        assert not guard.output(1).any()

    def test_its_wheels_slow_down_instead_of_locking(self, base):
        for k in range(6):
            base.offer(BASE.names, [0.45, 0.0], 100 * k * MS, stamp_ns=(100 + 100 * k) * MS)
            base.output(100 * k * MS)
        base.see_refusal("a wheel hangs in the air")
        assert base.output(510 * MS)[0] == pytest.approx(0.45)
        assert 0.0 < base.output(700 * MS)[0] < 0.4


TWO = ["/floating_platform/controller", "/floating_platform/stranger"]


class TestCommandWriters:
    """Two nodes that publish commands."""

    def test_while_two_nodes_publish_commands_the_valves_are_closed(self, guard):
        guard.offer(NAMES, GOOD, 0)
        guard.publishers.see(TWO, 1 * MS)
        assert not guard.output(1 * MS).any()
        assert not guard.answer(1 * MS).any()
        guard.offer(NAMES, GOOD, 2 * MS)
        assert not guard.output(2 * MS).any()
        assert guard.command.tolist() == [0.0] * 8  # nothing is left for the end of the hold

    def test_the_reason_names_both_nodes(self, guard):
        guard.publishers.see(TWO, 0)
        assert "2 nodes publish commands, and only one may: " + ", ".join(TWO) in guard.publishers.reason(0)

    def test_after_one_is_gone_and_a_settle_time_the_other_is_obeyed(self, guard):
        guard.publishers.see(TWO, 0)
        guard.publishers.see([], 10 * MS)
        guard.offer(NAMES, GOOD, 990 * MS)
        assert not guard.output(990 * MS).any()
        guard.offer(NAMES, GOOD, 1_010 * MS)
        assert guard.output(1_010 * MS).tolist() == GOOD
        assert guard.publishers.reason(1_010 * MS) == ""

    def test_one_node_is_obeyed(self, guard):
        guard.publishers.see(TWO[:1], 0)
        guard.offer(NAMES, GOOD, 0)
        assert guard.output(0).tolist() == GOOD

    def test_a_person_drives_although_two_controllers_do_not(self, guard):
        guard.publishers.see(TWO, 0)
        guard.offer_by_hand(NAMES, GOOD, 1 * MS)
        assert guard.output(1 * MS).tolist() == GOOD
        guard.offer_by_hand(NAMES, [0.0] * 8, 2 * MS)
        assert guard.give_back(3 * MS) == ""
        guard.offer(NAMES, GOOD, 4 * MS)
        assert not guard.output(4 * MS).any()

    def test_wheels_slow_down_instead_of_locking(self, base):
        for k in range(6):
            base.offer(BASE.names, [0.45, 0.0], 100 * k * MS, stamp_ns=(100 + 100 * k) * MS)
            base.output(100 * k * MS)
        base.publishers.see(TWO, 510 * MS)
        assert base.output(510 * MS)[0] == pytest.approx(0.45)
        assert 0.0 < base.output(700 * MS)[0] < 0.4
        assert base.output(1_200 * MS)[0] == 0.0

    def test_wheels_that_stand_after_a_silence_stand_under_a_stop_whatever_comes(self, base):
        for k in range(6):
            base.offer(BASE.names, [0.45, 0.0], 100 * k * MS, stamp_ns=(100 + 100 * k) * MS)
            base.output(100 * k * MS)
        assert base.output(9_000 * MS)[0] == 0.0  # the controller hangs
        base.publishers.see(TWO, 9_100 * MS)
        base.offer(BASE.names, [0.45, 0.0], 9_200 * MS, stamp_ns=9_200 * MS)
        assert not base.output(9_210 * MS).any()

    def test_a_stop_while_wheels_slow_down_lets_them_go_on_slowing_down(self, base):
        for k in range(6):
            base.offer(BASE.names, [0.45, 0.0], 100 * k * MS, stamp_ns=(100 + 100 * k) * MS)
            base.output(100 * k * MS)
        way = base.output(1_100 * MS)[0]
        assert 0.0 < way < 0.45
        base.publishers.see(TWO, 1_110 * MS)
        base.offer(BASE.names, [0.45, 0.0], 1_120 * MS, stamp_ns=1_120 * MS)
        assert 0.0 < base.output(1_130 * MS)[0] < way

    def test_the_safe_controller_begins_at_what_was_carried_out_and_not_at_a_strangers_command(self):
        begun = []

        class Noting:
            longest_s, doing = math.inf, "notes"

            def command(self, _since_s, last, _state):
                begun.append(last.tolist())
                return last

        guard = ActuatorGuard(THRUSTERS, Watchdog(200 * MS), refuge=Noting())
        guard.offer(NAMES, GOOD, 0)
        assert guard.output(0).tolist() == GOOD
        guard.publishers.see(TWO, 1 * MS)
        guard.offer(NAMES, [1.0] * 8, 2 * MS)
        guard.output(3 * MS)
        assert begun == [GOOD]


@given(
    st.lists(
        st.tuples(
            st.sampled_from(
                ["offer", "hand", "press", "released", "reset", "back", "refuse", "obey", "wait"]
            ),
            st.lists(st.floats(allow_nan=True, allow_infinity=True), max_size=10),
            st.integers(0, 300),
        ),
        max_size=30,
    )
)
@hypothesis_settings(max_examples=150, deadline=None)
def test_whatever_comes_the_output_is_a_command_within_limits_and_safe_under_the_e_stop(steps):
    guard = ActuatorGuard(THRUSTERS, Watchdog(200 * MS), control_dt=0.2)
    now = 0
    for what, values, ms in steps:
        now += ms * MS
        if what == "offer":
            guard.offer(NAMES, values, now)
        elif what == "hand":
            guard.offer_by_hand(NAMES, values, now)
        elif what in ("press", "released"):
            guard.estop.receive(what == "press", now)
        elif what == "reset":
            guard.estop.release(now)
        elif what == "back":
            guard.give_back(now)
        elif what in ("refuse", "obey"):
            guard.see_refusal("mode HOLD" if what == "refuse" else "")
        output = guard.output(now)
        assert output.shape == (8,)
        assert set(output.tolist()) <= {0.0, 1.0}
        if guard.estop.reason(now) or guard.watchdog.expired(now) or guard.held:
            assert not output.any()


def test_a_command_of_a_million_values_is_refused_without_being_read(guard):
    assert not guard.offer(NAMES, range(1_000_000), 0)
    assert "1000000 values" in guard.last_rejection
