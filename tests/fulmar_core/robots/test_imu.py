"""The inertial unit: noise, bias, scale, limits, steps, rate and delay, each by itself."""

from __future__ import annotations

import numpy as np
import pytest

from fulmar_core.robots.sensors.imu import Gyroscope, ImuSample, ImuSpec, InertialUnit
from fulmar_core.robots.sensors.odometer import Channel

TRUTH = ImuSample(np.array([0.0, 3.0, 9.81]), np.array([0.0, 0.0, 0.1]))


def begun(spec, seed=5, number=0):
    unit = InertialUnit(spec)
    unit.reset(seed, number)
    return unit


def force(unit, times, truth=TRUTH):
    return np.array([unit.measure(truth, time).specific_force for time in times])


def test_it_adds_its_two_noises_to_the_truth():
    unit = begun(ImuSpec(Channel(std=0.02), Gyroscope(std=0.003)))
    samples = [unit.measure(TRUTH, 0.01 * k) for k in range(4000)]
    forces = np.array([s.specific_force for s in samples]) - TRUTH.specific_force
    turns = np.array([s.angular_velocity for s in samples]) - TRUTH.angular_velocity
    assert forces.std() == pytest.approx(0.02, rel=0.03)  # 12,000 numbers: one sigma is 0.65 %
    assert turns.std() == pytest.approx(0.003, rel=0.03)
    assert abs(np.corrcoef(forces[:, 0], turns[:, 0])[0, 1]) < 0.06  # four sigma of independent noises


def test_without_errors_it_reports_the_truth():
    measured = begun(ImuSpec()).measure(TRUTH, 0.0)
    assert measured.specific_force.tolist() == TRUTH.specific_force.tolist()
    assert measured.angular_velocity.tolist() == TRUTH.angular_velocity.tolist()


def test_a_bias_and_a_scale_error_stay_for_an_episode_and_differ_between_episodes():
    spec = ImuSpec(Channel(bias_std=0.1, scale_std=0.05))
    unit = begun(spec)
    first = force(unit, (0.0, 1.0, 2.0))
    assert np.ptp(first, axis=0).max() == 0.0
    unit.reset(5, 1)
    assert (force(unit, (0.0,))[0] != first[0]).all()
    errors = np.array([force(begun(spec, number=n), (0.0,))[0] for n in range(800)]) - TRUTH.specific_force
    np.testing.assert_allclose(errors.std(axis=0), np.hypot(0.1, 0.05 * TRUTH.specific_force), rtol=0.1)


def test_readings_are_cut_and_come_in_steps():
    unit = begun(ImuSpec(Channel(limit=8.0, quantum=0.25)))
    truth = ImuSample(np.array([0.3, -3.1, 9.81]), np.zeros(3))
    np.testing.assert_allclose(force(unit, (0.0,), truth)[0], [0.25, -3.0, 8.0])
    between = begun(ImuSpec(Channel(limit=7.9, quantum=0.25)))
    np.testing.assert_allclose(force(between, (0.0,), truth)[0], [0.25, -3.0, 7.75])


def readings_of(spec, times):
    """Which of the true readings, numbered by their time, is reported at each time."""
    unit = begun(spec)
    return [unit.measure(ImuSample(np.full(3, t), np.zeros(3)), t).specific_force[0] for t in times]


TIMES = np.round(np.arange(0.0, 0.5, 0.02), 9)


def test_it_reads_anew_at_its_rate_and_repeats_itself_between():
    seen = readings_of(ImuSpec(rate_hz=10.0), TIMES)
    np.testing.assert_allclose(seen, 0.1 * np.floor(TIMES / 0.1 + 1e-6))


def test_it_is_as_late_as_it_says_and_begins_with_the_first_reading():
    seen = readings_of(ImuSpec(delay_s=0.1), TIMES)
    np.testing.assert_allclose(seen, np.clip(TIMES - 0.1, 0.0, None), atol=1e-9)


def test_rate_and_delay_add_up():
    seen = readings_of(ImuSpec(rate_hz=10.0, delay_s=0.05), TIMES)
    np.testing.assert_allclose(
        seen, np.clip(0.1 * np.floor((TIMES - 0.05) / 0.1 + 1e-6), 0.0, None), atol=1e-9
    )


def test_a_reset_forgets_the_past_and_gives_the_same_noise_again():
    unit = begun(ImuSpec(Channel(std=0.1), delay_s=0.04))
    first = force(unit, TIMES)
    unit.reset(5, 0)
    np.testing.assert_array_equal(force(unit, TIMES), first)


def test_a_kept_reading_does_not_change_later():
    unit = begun(ImuSpec(rate_hz=1.0))
    kept = unit.measure(TRUTH, 0.0)
    kept.specific_force[0] = 99.0
    assert unit.measure(TRUTH, 0.1).specific_force[0] == TRUTH.specific_force[0]


def test_rates_and_delays_without_meaning_are_refused():
    with pytest.raises(ValueError, match="must not be negative"):
        ImuSpec(rate_hz=-1.0)
    with pytest.raises(ValueError, match="must not be negative"):
        ImuSpec(delay_s=-0.1)
