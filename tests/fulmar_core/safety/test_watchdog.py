"""The watchdog, with injected time."""

from __future__ import annotations

import pytest

from fulmar_core.config.errors import SafetyError
from fulmar_core.safety.watchdog import Watchdog, checked_timeout
from fulmar_core.wires.silence import LONGEST_S, default_timeout

MS = 1_000_000


@pytest.mark.parametrize(("dt", "timeout"), [(0.02, 0.2), (0.1, 0.2), (0.2, 0.4), (0.25, 0.5), (10.0, 0.5)])
def test_the_default_is_two_control_steps_between_200_and_500_ms(dt, timeout):
    assert default_timeout(dt) == pytest.approx(timeout)


@pytest.mark.parametrize("timeout", [0, -1])
def test_a_timeout_that_would_not_protect_is_refused(timeout):
    with pytest.raises(SafetyError, match="must be greater than 0"):
        Watchdog(timeout)


def test_before_the_first_command_actuators_are_safe_but_nothing_has_tripped():
    dog = Watchdog(200 * MS)
    assert dog.expired(10**12)
    assert (dog.trips, dog.tripped, dog.silent_ns(10**12)) == (0, False, 0)


def test_a_command_holds_for_the_timeout_and_not_a_nanosecond_longer():
    dog = Watchdog(200 * MS)
    dog.feed(1000)
    assert not dog.expired(1000 + 200 * MS)
    assert dog.expired(1001 + 200 * MS)
    assert dog.tripped


def test_each_silence_counts_once():
    dog = Watchdog(200 * MS)
    for start in (0, 1000 * MS):
        dog.feed(start)
        for late in (300, 400, 500):
            assert dog.expired(start + late * MS)
    assert dog.trips == 2


def test_a_new_command_ends_the_silence():
    dog = Watchdog(200 * MS)
    dog.feed(0)
    dog.expired(300 * MS)
    dog.feed(400 * MS)
    assert not dog.expired(500 * MS)
    assert not dog.tripped
    assert dog.silent_ns(500 * MS) == 100 * MS


@pytest.mark.parametrize("seconds", [0.0, 0.01, 0.2, LONGEST_S])
def test_a_timeout_that_protects_or_is_off_may_be_set(seconds):
    assert checked_timeout(seconds) == seconds


@pytest.mark.parametrize("seconds", [float("nan"), float("inf"), float("-inf"), -0.001, -1.0, 0.501, 3600.0])
def test_a_timeout_that_lets_a_dead_controller_fly_on_is_refused(seconds):
    with pytest.raises(
        SafetyError, match=r"the command timeout is .* s; it must be from 0 \(off\) to 0\.5 s\."
    ):
        checked_timeout(seconds)


def test_after_a_reset_it_waits_for_a_first_command_without_a_trip():
    dog = Watchdog(200 * MS)
    dog.feed(0)
    dog.reset()
    assert dog.expired(500 * MS)
    assert (dog.trips, dog.tripped, dog.silent_ns(500 * MS)) == (0, False, 0)


def test_while_a_simulation_stands_still_no_silence_grows_and_then_it_goes_on_from_there():
    dog = Watchdog(200 * MS)
    dog.feed(0)
    dog.hold(150 * MS)
    assert not dog.expired(900 * MS)
    dog.go_on(1000 * MS)
    assert dog.silent_ns(1000 * MS) == 150 * MS
    assert dog.expired(1051 * MS)
    assert dog.trips == 1


def test_a_command_that_comes_while_it_stands_still_is_new_when_it_goes_on():
    dog = Watchdog(200 * MS)
    dog.hold(0)
    dog.feed(900 * MS)
    dog.go_on(1000 * MS)
    assert dog.silent_ns(1000 * MS) == 0
