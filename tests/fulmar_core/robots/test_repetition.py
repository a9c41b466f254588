"""A source that repeats its last value with new stamps is stuck."""

from __future__ import annotations

import numpy as np
import pytest

from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.sensors.odometer import Channel
from fulmar_core.robots.sensors.repetition import (
    FEWEST,
    FROZEN_AFTER,
    RepetitionCheck,
    is_noisy,
    without_noise,
)

MS = 1_000_000
HERE = np.array([1.0, 2.0])


def seen(check: RepetitionCheck, count: int, *, every_ms: int = 5) -> list[bool]:
    """What the check says of a value and of its repeats."""
    return [check.see(HERE.copy(), i * every_ms * MS) for i in range(count + 1)]


def test_a_source_is_frozen_after_ten_repeats_and_lives_with_the_first_value_that_differs():
    check = RepetitionCheck()
    assert seen(check, FROZEN_AFTER) == [False] * FROZEN_AFTER + [True]
    assert (check.repeats, check.frozen) == (FROZEN_AFTER, True)
    assert not check.see(np.nextafter(HERE, 2.0), 10_000 * MS)
    assert (check.repeats, check.frozen) == (0, False)


def test_of_a_slow_source_a_time_of_repeats_counts():
    check = RepetitionCheck(after_s=0.25)
    assert seen(check, 7, every_ms=40) == [False] * 7 + [True]


def test_values_that_are_held_while_a_few_messages_get_lost_are_no_fault():
    check = RepetitionCheck(after_s=0.25)
    assert not any(seen(check, FEWEST - 1, every_ms=1_000))


def test_a_source_without_noise_may_repeat_itself_for_ever():
    assert not any(seen(RepetitionCheck(after=0), 1_000))


def test_after_forgetting_repeats_count_anew():
    check = RepetitionCheck()
    seen(check, FROZEN_AFTER)
    check.forget()
    assert not check.frozen and not any(seen(check, FROZEN_AFTER - 1))


@pytest.mark.parametrize(
    ("channels", "noisy"),
    [
        ([Channel()], False),
        ([Channel(bias_std=1.0, scale_std=1.0, limit=1.0)], False),
        ([Channel(std=0.001)], True),
        ([Channel(), Channel(std=0.001)], True),
        ([Channel(std=0.001, quantum=0.01)], False),
        ([Channel(std=0.01, quantum=0.001)], True),
    ],
)
def test_noise_that_a_quantum_hides_is_none(channels, noisy):
    assert is_noisy(*channels) is noisy


def test_shipped_robots_have_noise_in_what_they_measure():
    sensors = load_robot("cubesat_wheels").sensors
    for spec in (sensors.odometry.heading, sensors.imu.gyroscope, sensors.star_tracker, sensors.wheels):
        assert is_noisy(spec)


def test_sensors_of_a_simulation_without_noise_have_none_and_keep_their_range():
    sensors = load_robot("cubesat_wheels").sensors
    exact = without_noise(sensors)
    assert not any(
        is_noisy(spec)
        for spec in (exact.odometry.heading, exact.imu.gyroscope, exact.star_tracker, exact.wheels)
    )
    assert exact.imu.gyroscope_range == sensors.imu.gyroscope_range
