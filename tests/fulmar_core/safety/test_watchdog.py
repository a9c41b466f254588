"""The watchdog, with injected time."""

from __future__ import annotations

import pytest

from fulmar_core.errors import SafetyError
from fulmar_core.safety.watchdog import Watchdog, default_timeout

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
