"""What odometry and inertial unit make of the truth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.sensors.odometer import Channel, Odometer, OdometrySpec
from fulmar_core.states.counter_rng import WORLD, Draws
from fulmar_core.states.planar import PlanarState
from fulmar_core.worlds.scenario import draw_world, load_scenario

MANY = 20_000  # the sample deviation is then within 0.5 % of the true one (one sigma); we allow 3 %
ROBOT = load_robot("floating_platform")
VALUES = (1.0, -2.0, 0.5, 0.2, -0.1, 0.3)
DT = 0.1


def worlds(count, **values):
    draws = Draws(0, np.arange(count), np.zeros(count), WORLD)
    world = draw_world(ROBOT, load_scenario("nominal"), draws)
    shapes = {name: getattr(world, name).shape for name in values}
    return replace(world, **{name: np.broadcast_to(value, shapes[name]) for name, value in values.items()})


def alike(**channel):
    """The same channel for every column."""
    return OdometrySpec(*(Channel(**channel) for _ in range(4)))


class Bench:
    """An odometer that sees the same truth again and again, or one that grows with each step."""

    def __init__(self, spec, count, *, world=None, max_delay_s=0.0, noisy=True, blurred=False, seed=3):
        self.world = worlds(count) if world is None else world
        self.odometer = Odometer(
            spec, seed=seed, period=DT, max_delay_s=max_delay_s, noisy=noisy, blurred=blurred
        )
        self.numbers, self.repeats, self.steps = np.arange(count), np.zeros(count, int), np.zeros(count, int)

    def measure(self, *, growing=False, only=None):
        if only is not None:
            self.repeats[only] += 1
            self.steps[only] = 0
        values = [np.full(len(self.numbers), value) for value in VALUES]
        if growing:
            values = [column + self.steps for column in values]
        truth = PlanarState(*values)
        if only is None:
            measured = self.odometer.measure(truth, self.world, self.numbers, self.repeats, self.steps)
            self.steps = self.steps + 1
        else:
            first = self.odometer.first(truth, self.world, self.numbers, self.repeats)
            measured = self.odometer.restart(truth, only, first)
        return np.stack([getattr(measured, name) for name in PlanarState.COLUMNS])


def first(spec, count=MANY, **kwargs):
    return Bench(spec, count, **kwargs).measure() - np.array(VALUES)[:, None]


def test_without_errors_the_odometry_is_the_truth():
    assert not first(OdometrySpec()).any()
    assert not first(alike(std=0.1), noisy=False).any()


def test_each_column_has_the_noise_of_its_channel_and_no_mean():
    deviations = (0.01, 0.02, 0.03, 0.04)
    error = first(OdometrySpec(*(Channel(std=value) for value in deviations)))
    of_columns = [0.01, 0.01, 0.02, 0.03, 0.03, 0.04]
    np.testing.assert_allclose(error.std(axis=1), of_columns, rtol=0.03)
    np.testing.assert_allclose(error.mean(axis=1), 0.0, atol=4 * 0.04 / np.sqrt(MANY))
    assert np.abs(np.corrcoef(error) - np.eye(6)).max() < 4.5 / np.sqrt(MANY)


def test_a_world_s_noise_is_a_factor_on_that_of_the_robot():
    error = first(alike(std=0.01), world=worlds(MANY, noise=3.0))
    np.testing.assert_allclose(error.std(axis=1), 0.03, rtol=0.03)


@pytest.mark.parametrize("noisy", [False, True], ids=["perfect sensors", "noisy sensors"])
def test_velocity_noise_of_a_world_is_uniform_to_its_bounds_on_velocities_alone(noisy):
    world = worlds(
        MANY, velocity_noise=0.04, yaw_rate_noise=0.02, noise=0.0, sensor_bias=0.0, sensor_scale=0.0
    )
    error = first(alike(std=0.01), world=world, noisy=noisy, blurred=True)
    assert not error[:3].any()
    most = np.array([0.04, 0.04, 0.02])
    np.testing.assert_allclose(np.abs(error[3:]).max(axis=1), most, rtol=2e-3)
    np.testing.assert_allclose(error[3:].std(axis=1), most / np.sqrt(3.0), rtol=0.03)
    np.testing.assert_allclose(error[3:].mean(axis=1), 0.0, atol=4 * 0.04 / np.sqrt(3.0 * MANY))
    assert np.abs(np.corrcoef(error[3:]) - np.eye(3)).max() < 4.5 / np.sqrt(MANY)


def test_velocity_noise_leaves_every_other_error_as_it_was():
    world = worlds(50, velocity_noise=0.0, yaw_rate_noise=0.0)
    plain, blurred = (Bench(everything(), 50, world=world, max_delay_s=0.1, blurred=b) for b in (False, True))
    for _ in range(5):
        np.testing.assert_array_equal(plain.measure(growing=True), blurred.measure(growing=True))


def test_noise_is_new_with_each_measurement_and_bias_stays():
    bench = Bench(alike(std=0.01), MANY)
    one, two = bench.measure(), bench.measure()
    assert np.abs([np.corrcoef(a, b)[0, 1] for a, b in zip(one, two, strict=True)]).max() < 4.5 / np.sqrt(
        MANY
    )
    bench = Bench(alike(bias_std=0.01), 500)
    np.testing.assert_array_equal(bench.measure(), bench.measure())


def test_biases_and_scale_errors_are_those_of_the_world_in_the_channel_s_own_deviations():
    bias = np.random.default_rng(1).normal(size=(6, 50))
    error = first(alike(bias_std=0.02), 50, world=worlds(50, sensor_bias=bias))
    np.testing.assert_allclose(error, 0.02 * bias, rtol=0, atol=1e-12)
    error = first(alike(scale_std=0.02), 50, world=worlds(50, sensor_scale=bias))
    np.testing.assert_allclose(error, 0.02 * bias * np.array(VALUES)[:, None], rtol=0, atol=1e-12)


def test_readings_are_cut_at_the_limit_and_0_is_no_limit():
    spec = OdometrySpec(position=Channel(limit=1.5), velocity=Channel(limit=0.15))
    measured = Bench(spec, 3).measure()[:, 0]
    assert measured.tolist() == [1.0, -1.5, 0.5, 0.15, -0.1, 0.3]


def test_readings_are_whole_quanta_and_0_is_none():
    spec = OdometrySpec(position=Channel(quantum=0.3), yaw_rate=Channel(quantum=0.25))
    measured = Bench(spec, 3).measure()[:, 0]
    assert measured.tolist() == pytest.approx([0.9, -2.1, 0.5, 0.2, -0.1, 0.25])


@pytest.mark.parametrize("behind", [0, 1, 3])
def test_a_delayed_reading_is_that_of_some_measurements_ago_and_before_the_first_one_the_first(behind):
    bench = Bench(replace(OdometrySpec(), delay_s=behind * DT), 4)
    seen = [bench.measure(growing=True)[0, 0] - VALUES[0] for _ in range(6)]
    assert seen == pytest.approx(np.maximum(0.0, np.arange(6) - behind))


def test_each_world_has_its_own_delay_on_top():
    bench = Bench(OdometrySpec(), 3, world=worlds(3, sensor_delay=[0.0, 0.1, 0.2]), max_delay_s=0.2)
    for _ in range(5):
        seen = bench.measure(growing=True)
    np.testing.assert_allclose(seen[0] - VALUES[0], [4.0, 3.0, 2.0], rtol=0, atol=1e-12)


def test_between_two_readings_of_a_slow_sensor_the_last_one_stays():
    bench = Bench(replace(OdometrySpec(), rate_hz=1.0 / (3 * DT)), 2)
    seen = [bench.measure(growing=True)[0, 0] - VALUES[0] for _ in range(8)]
    assert seen == pytest.approx([0, 0, 0, 3, 3, 3, 6, 6])


@pytest.mark.parametrize("rate_hz", [9.0, 7.0, 4.0, 3.0, 0.6, 25.0])
def test_a_rate_that_is_no_whole_part_of_the_calls_is_kept_on_average(rate_hz):
    bench = Bench(replace(OdometrySpec(), rate_hz=rate_hz), 1)
    seen = [bench.measure(growing=True)[0, 0] for _ in range(1000)]
    assert len(set(seen)) == pytest.approx(min(rate_hz, 1.0 / DT) * 1000 * DT, abs=1)


def test_a_heading_s_error_of_scale_and_limit_are_of_the_angle_and_not_of_all_turns():
    turned = 20 * np.pi + 0.5  # as a batch counts it, which MuJoCo does not
    for channel in (Channel(scale_std=0.1), Channel(limit=3.2)):
        spec, world = OdometrySpec(heading=channel), worlds(2, sensor_scale=1.0)
        truth = PlanarState(*(np.full(2, turned if name == "yaw" else 0.0) for name in PlanarState.COLUMNS))
        odometer = Odometer(spec, seed=3, period=DT)
        begun = np.zeros(2, int)
        measured = odometer.measure(truth, world, np.arange(2), begun, begun)
        assert measured.yaw == pytest.approx(0.5 * (1.0 + channel.scale_std), abs=1e-9)


def test_a_limit_between_two_quanta_is_not_exceeded():
    spec = OdometrySpec(position=Channel(limit=0.26, quantum=0.1))
    assert Bench(spec, 2).measure()[:2, 0].tolist() == pytest.approx([0.2, -0.2])


def test_a_lost_measurement_leaves_the_last_one_and_the_first_is_never_lost():
    bench = Bench(OdometrySpec(), MANY, world=worlds(MANY, dropout=0.25))
    assert not (bench.measure(growing=True)[0] - VALUES[0]).any()
    seen = bench.measure(growing=True)[0] - VALUES[0]
    assert set(np.unique(np.round(seen, 9))) == {0.0, 1.0}
    assert np.mean(seen < 0.5) == pytest.approx(0.25, abs=4 * np.sqrt(0.25 * 0.75 / MANY))


def everything():
    channel = Channel(0.01, 0.02, 0.03, 2.5, 0.001)
    return OdometrySpec(channel, channel, channel, channel, rate_hz=5.0, delay_s=0.1)


def restless(count):
    return worlds(count, sensor_delay=np.linspace(0.0, 0.3, count), dropout=0.2)


def test_worlds_that_begin_anew_forget_their_past_and_leave_the_others_as_they_were():
    bench, same = (Bench(everything(), 6, world=restless(6), max_delay_s=0.3) for _ in range(2))
    for each in (bench, same):
        for _ in range(5):
            before = each.measure(growing=True)
    again = bench.measure(growing=True, only=np.array([1, 4]))
    np.testing.assert_array_equal(again[:, [0, 2, 3, 5]], before[:, [0, 2, 3, 5]])
    assert np.abs(again[0, [1, 4]] - VALUES[0]).max() < 0.5  # nothing of the five steps before
    bench.steps[[1, 4]] = 1
    for _ in range(4):
        mine, theirs = bench.measure(growing=True), same.measure(growing=True)
        np.testing.assert_array_equal(mine[:, [0, 2, 3, 5]], theirs[:, [0, 2, 3, 5]])


def test_a_world_is_measured_alike_in_a_batch_of_any_size():
    many, few = Bench(everything(), 40, world=restless(40), max_delay_s=0.3), None
    few = Bench(everything(), 7, world=restless(40)[np.arange(7)], max_delay_s=0.3)
    for _ in range(8):
        np.testing.assert_array_equal(many.measure(growing=True)[:, :7], few.measure(growing=True))


def test_another_seed_or_episode_gives_other_noise():
    one = Bench(alike(std=0.1), 4)
    first_episode, second_episode = one.measure(), one.measure(only=np.arange(4))
    assert not np.any(first_episode == second_episode)
    assert not np.any(Bench(alike(std=0.1), 4, seed=4).measure() == first_episode)


def test_channels_and_rates_without_meaning_are_refused():
    with pytest.raises(ValueError, match="must not be negative"):
        Channel(quantum=-1.0)
    with pytest.raises(ValueError, match="must not be negative"):
        OdometrySpec(delay_s=-0.1)


def test_one_world_has_the_noise_that_it_has_beside_others():
    alone, beside = Bench(alike(std=0.1), 1), Bench(alike(std=0.1), 2)
    for _ in range(150):
        np.testing.assert_array_equal(alone.measure()[:, 0], beside.measure()[:, 0])
    for bench in (alone, beside):
        bench.measure(only=np.array([0]))
    for _ in range(3):
        np.testing.assert_array_equal(alone.measure()[:, 0], beside.measure()[:, 0])
