"""Disturbances, drawn once an episode: each entry of a scenario says what it changes, and changes nothing else."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.config.paths import config_names
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.states.counter_rng import WORLD, Draws
from fulmar_core.states.planar import PlanarState
from fulmar_core.worlds.holdability import uncontrollable_losses
from fulmar_core.worlds.link import Link
from fulmar_core.worlds.parts import (
    Actuation,
    Air,
    InertiaChange,
    Kick,
    Push,
    Sensing,
    Slope,
    Solar,
    Stuck,
    Supply,
    Tether,
    Wave,
)
from fulmar_core.worlds.scenario import (
    Scenario,
    bearing_late_s,
    draw_world,
    load_scenario,
)
from fulmar_core.worlds.spatial_world import draw_spatial_world
from fulmar_core.worlds.world import FIELDS

ROBOTS = {name: load_robot(name) for name in config_names("robots")}
PLANAR = {name: robot for name, robot in ROBOTS.items() if robot.state_type is PlanarState}
PLATFORM, BOAT = ROBOTS["floating_platform"], ROBOTS["kingfisher"]
COUNT = 2000
UNCONTROLLABLE = {"stranding": True}  # word: key of scenario files
STILL = Scenario("nothing happens", sensor_noise=False, body="nominal")
SEEING = replace(STILL, sensor_noise=True)
ALL = Scenario(
    "everything happens", sensor_noise=True, body="uncertain",
    push=Push(0.2, 0.1), wave=Wave(0.1, 0.05), kick=Kick(0.3),
    tether=Tether((0.02, 0.05), 1.5, 0.1), slope=Slope((1.0, 3.0), 30.0),
    actuation=Actuation(0.05, 0.0, (0.8, 1.1), 0.04, 0.0, (0.01, 0.05), 2, 0.5),
    sensing=Sensing(2.0, 2.0, 0.1, 0.2, (0.01, 0.03), (0.0, 0.02)),
)  # fmt: skip

# What is changed, by which entry, of which scenario, and which part of a world may differ for it.
ENTRIES = {
    "body": (STILL, {"body": "uncertain"}, {"mass", "yaw_inertia", "com_x", "com_y", "drag"}),
    "sensor_noise": (STILL, {"sensor_noise": True}, {"noise", "sensor_bias", "sensor_scale"}),
    "push.force": (STILL, {"push": Push(force=0.1)}, {"force_x", "force_y"}),
    "push.torque": (STILL, {"push": Push(torque=0.1)}, {"torque"}),
    "push.least": (
        replace(STILL, push=Push(0.1, 0.1)),
        {"push": Push(0.1, 0.1, least=0.9)},
        {"force_x", "force_y", "torque"},
    ),
    "wave.force": (STILL, {"wave": Wave(force=0.1)}, {"wave_force"}),
    "wave.torque": (STILL, {"wave": Wave(torque=0.1)}, {"wave_torque"}),
    "wave.least": (
        replace(STILL, wave=Wave(0.1, 0.1)),
        {"wave": Wave(0.1, 0.1, least=0.9)},
        {"wave_force", "wave_torque"},
    ),
    "wave.wave_number": (STILL, {"wave": Wave(wave_number=(5.0, 6.0))}, {"wave_number"}),
    "kick.force": (STILL, {"kick": Kick(force=0.1)}, {"kick"}),
    "kick.every_s": (STILL, {"kick": Kick(every_s=(8.0, 9.0))}, {"kick_period"}),
    "tether.stiffness": (STILL, {"tether": Tether((0.01, 0.02))}, {"tether_stiffness"}),
    "tether.reach": (STILL, {"tether": Tether(reach=1.0)}, {"anchor_x", "anchor_y"}),
    "tether.lever": (STILL, {"tether": Tether(lever=0.1)}, {"tether_x", "tether_y"}),
    "slope.milliradians": (STILL, {"slope": Slope((1.0, 2.0), 10.0)}, {"force_x", "force_y"}),
    "slope.direction_deg": (
        replace(STILL, slope=Slope((1.0, 2.0))),
        {"slope": Slope((1.0, 2.0), 10.0)},
        {"force_x", "force_y"},
    ),
    "actuation.noise": (STILL, {"actuation": Actuation(noise=0.1)}, {"action_noise"}),
    "actuation.least_noise": (
        replace(STILL, actuation=Actuation(noise=0.1)),
        {"actuation": Actuation(noise=0.1, least_noise=0.9)},
        {"action_noise"},
    ),
    "actuation.opening_delay_s": (STILL, {"actuation": Actuation(opening_delay_s=(0.01, 0.02))}, {"opening_delay"}),
    "actuation.gain": (STILL, {"actuation": Actuation(gain=(0.8, 0.9))}, {"gain"}),
    "actuation.delay_s": (STILL, {"actuation": Actuation(delay_s=0.1)}, {"action_delay"}),
    "actuation.least_delay": (
        replace(STILL, actuation=Actuation(delay_s=0.1)),
        {"actuation": Actuation(delay_s=0.1, least_delay=0.9)},
        {"action_delay"},
    ),
    "actuation.failures": (
        replace(STILL, actuation=Actuation(failures=1, failure_chance=0.5)),
        {"actuation": Actuation(failures=3, failure_chance=0.5)},
        {"alive"},
    ),
    "actuation.failure_chance": (
        replace(STILL, actuation=Actuation(failures=1, failure_chance=0.1)),
        {"actuation": Actuation(failures=1, failure_chance=0.9)},
        {"alive"},
    ),
    "actuation.stranding": (  # word: key of scenario files
        replace(STILL, actuation=Actuation(failures=2, failure_chance=0.1)),
        {"actuation": Actuation(failures=2, failure_chance=1.0, **UNCONTROLLABLE)},
        {"alive"},
    ),
    "actuation.stuck": (
        STILL,
        {"actuation": Actuation(stuck=Stuck(("*",), 0.5, (1.0, 2.0)))},
        {"stuck_part", "stuck_at", "stuck_from"},
    ),
    "actuation.supply": (
        STILL,
        {"actuation": Actuation(supply=Supply(0.1, 2.0, 3.0, tank=0.1))},
        {"supply_left", "supply_from", "supply_over", "tank_fill"},
    ),
    "sensing.noise": (SEEING, {"sensing": Sensing(noise=2.0)}, {"noise"}),
    "sensing.bias": (SEEING, {"sensing": Sensing(bias=2.0)}, {"sensor_bias", "sensor_scale"}),
    "sensing.delay_s": (SEEING, {"sensing": Sensing(delay_s=0.1)}, {"sensor_delay"}),
    "sensing.dropout": (SEEING, {"sensing": Sensing(dropout=0.1)}, {"dropout"}),
    "sensing.velocity_noise": (STILL, {"sensing": Sensing(velocity_noise=(0.0, 0.1))}, {"velocity_noise"}),
    "sensing.yaw_rate_noise": (STILL, {"sensing": Sensing(yaw_rate_noise=(0.0, 0.1))}, {"yaw_rate_noise"}),
    "bearing_late_s": (STILL, {"bearing_late_s": (1.0, 2.0)}, set()),  # of simulated plants, not of worlds
    "held_s": (STILL, {"held_s": (1.0, 2.0)}, set()),
    "link": (STILL, {"link": Link(delay_s=0.1)}, set()),  # between plant and controller
    "sensing.gyroscope": (SEEING, {"sensing": Sensing(gyroscope=2.0)}, set()),  # of simulated sensors
    "sensing.gyroscope_dies_s": (SEEING, {"sensing": Sensing(gyroscope_dies_s=2.0)}, set()),
    "orbit_rate": (STILL, {"orbit_rate": 0.001}, set()),  # of worlds in space
    "air.wind": (STILL, {"air": Air(wind=(1.0, 2.0))}, set()),  # of aircraft
    "air.turbulence": (STILL, {"air": Air(turbulence=7.7)}, set()),
    "air.least_turbulence": (STILL, {"air": Air(turbulence=7.7, least_turbulence=0.5)}, set()),
    "air.altitude": (STILL, {"air": Air(altitude=100.0)}, set()),
    "sensing.least_delay": (
        replace(SEEING, sensing=Sensing(delay_s=0.1)),
        {"sensing": Sensing(delay_s=0.1, least_delay=0.9)},
        {"sensor_delay"},
    ),
    "solar.force": (STILL, {"solar": Solar(force=1e-6)}, set()),
    "solar.arm": (replace(STILL, solar=Solar(1e-6)), {"solar": Solar(1e-6, 0.01)}, set()),
    **{
        f"inertia.{field.name}": (STILL, {"inertia": InertiaChange(**{field.name: 0.1})}, set())
        for field in fields(InertiaChange)
    },
}  # fmt: skip
PARTS = {
    "push": Push,
    "wave": Wave,
    "kick": Kick,
    "tether": Tether,
    "slope": Slope,
    "solar": Solar,
    "air": Air,
    "inertia": InertiaChange,
    "actuation": Actuation,
    "sensing": Sensing,
}


def worlds(scenario, robot=PLATFORM, *, count=COUNT, seed=7):
    draws = Draws(seed, np.arange(count), np.zeros(count), WORLD)
    return draw_world(robot, scenario, draws)


def fills(values, low, high):
    """All within a span, and up to 2 % of both its ends."""
    margin = 0.02 * (high - low)
    assert low - 1e-12 <= np.min(values) < low + margin
    assert high - margin < np.max(values) <= high + 1e-12


def test_the_table_of_this_file_has_every_entry_of_a_scenario():
    names = {field.name for field in fields(Scenario)} - {"title"}
    every = {f"{name}.{part.name}" for name in PARTS for part in fields(PARTS[name])} | (names - set(PARTS))
    assert every == set(ENTRIES)


@pytest.mark.parametrize("entry", ENTRIES)
@pytest.mark.parametrize("robot", [PLATFORM, BOAT], ids=lambda robot: robot.name)
def test_an_entry_changes_what_it_says_and_nothing_else(robot, entry):
    without, change, meant = ENTRIES[entry]
    before, after = worlds(without, robot), worlds(replace(without, **change), robot)
    differing = {name for name in FIELDS if not np.array_equal(getattr(before, name), getattr(after, name))}
    without_sense = {"drag"} if robot is PLATFORM else {"opening_delay"}  # in air; of propellers
    assert differing == meant - without_sense


@pytest.mark.parametrize("robot", ROBOTS.values(), ids=ROBOTS)
def test_the_ideal_world_is_the_nominal_body_in_stillness(robot):
    world = worlds(load_scenario("ideal"), robot, count=5)
    assert np.all(world.mass == robot.body.mass)
    assert np.all(world.yaw_inertia == robot.body.inertia[2])
    assert np.all(world.gain == 1.0)
    assert np.all(world.alive == 1.0)
    quiet = ("wave_force", "wave_torque", "kick", "tether_stiffness", "opening_delay", "velocity_noise")
    for name in ("force_x", "force_y", "torque", "noise", "dropout", *quiet):
        assert not getattr(world, name).any(), name


@pytest.mark.parametrize("robot", PLANAR.values(), ids=PLANAR)
def test_an_uncertain_body_covers_its_whole_span_and_never_leaves_it(robot):
    world, spans = worlds(ALL, robot), robot.uncertainty
    fills(world.mass, *spans.mass)
    fills(world.yaw_inertia, *spans.yaw_inertia)
    if spans.drag[0] < spans.drag[1]:
        fills(world.drag, *spans.drag)
    if spans.center_of_mass:
        fills(np.hypot(world.com_x, world.com_y), 0.0, spans.center_of_mass)


def test_mass_and_inertia_are_drawn_apart():
    world = worlds(ALL)
    assert abs(np.corrcoef(world.mass, world.yaw_inertia)[0, 1]) < 4.0 / np.sqrt(COUNT)


def test_pushes_point_everywhere_and_are_shares_of_what_the_robot_can_do_itself():
    for robot in (PLATFORM, BOAT):
        world = worlds(replace(STILL, push=Push(0.2, 0.1, least=0.25)), robot)
        size = np.hypot(world.force_x, world.force_y)
        fills(size, 0.25 * 0.2 * robot.performance.force, 0.2 * robot.performance.force)
        quadrants = {(x > 0, y > 0) for x, y in zip(world.force_x, world.force_y, strict=True)}
        assert len(quadrants) == 4
        fills(np.abs(world.torque), 0.25 * 0.1 * robot.performance.torque, 0.1 * robot.performance.torque)
        assert 0.4 < np.mean(world.torque > 0.0) < 0.6


def test_a_slope_pulls_the_weight_the_same_way_in_every_episode():
    world = worlds(replace(STILL, slope=Slope((1.0, 3.0), 30.0)))
    fills(np.hypot(world.force_x, world.force_y), 5.32 * 9.81 * 0.001, 5.32 * 9.81 * 0.003)
    np.testing.assert_allclose(np.degrees(np.arctan2(world.force_y, world.force_x)), 30.0)


def test_an_air_line_is_drawn_within_its_stiffness_reach_and_lever():
    world = worlds(replace(STILL, tether=Tether((0.02, 0.05), 1.5, 0.1)))
    fills(world.tether_stiffness, 0.02, 0.05)
    fills(np.hypot(world.anchor_x, world.anchor_y), 0.0, 1.5)
    fills(np.hypot(world.tether_x, world.tether_y), 0.0, 0.1)


def test_the_least_share_1_makes_every_magnitude_exact():
    world = worlds(
        replace(
            STILL,
            wave=Wave(0.2, least=1.0),
            actuation=Actuation(noise=0.05, least_noise=1.0),
            push=Push(0.4, 0.1, 1.0),
        )
    )
    np.testing.assert_allclose(np.hypot(world.force_x, world.force_y), 0.4, rtol=1e-12)
    np.testing.assert_allclose(np.abs(world.torque), 0.031, rtol=1e-12)
    assert np.all(world.wave_force == 0.2)
    assert np.all(world.action_noise == 0.05)


def test_waves_and_kicks_are_shares_of_what_the_robot_can_do_itself():
    world = worlds(ALL, BOAT)
    fills(world.wave_force, 0.0, 0.1 * 39.0)
    fills(world.wave_torque, 0.0, 0.05 * 8.9)
    fills(world.wave_number, 0.25, 3.0)
    fills(world.kick, 0.0, 0.3 * 39.0)
    fills(world.kick_period, 4.0, 6.0)


def test_each_actuator_has_a_gain_of_its_own_within_the_span():
    gain = worlds(ALL).gain
    assert gain.shape == (8, COUNT)
    for row in gain:
        fills(row, 0.8, 1.1)
    assert abs(np.corrcoef(gain[0], gain[1])[0, 1]) < 4.0 / np.sqrt(COUNT)


@pytest.mark.parametrize("most", [0, 1, 3])
def test_no_more_actuators_fail_than_may_and_each_candidate_with_its_chance(most):
    alive = worlds(
        replace(STILL, actuation=Actuation(failures=most, failure_chance=0.5 if most else 0.0))
    ).alive
    failed = 8.0 - alive.sum(axis=0)
    assert failed.max() == most
    assert failed.mean() == pytest.approx(0.5 * most, abs=4 * np.sqrt(most * 0.25 / COUNT) + 1e-12)
    if most:  # any of them
        np.testing.assert_allclose(1.0 - alive.mean(axis=1), most * 0.5 / 8, atol=0.035)


def test_uncontrollable_failures_come_together_each_set_as_often_and_with_the_chance_of_one():
    together = Actuation(failures=2, failure_chance=0.75, **UNCONTROLLABLE)
    alive = worlds(replace(STILL, actuation=together)).alive.T
    sets, counts = np.unique(alive, axis=0, return_counts=True)
    lost = {tuple(np.flatnonzero(row < 0.5)): count for row, count in zip(sets, counts, strict=True)}
    assert lost.pop(()) == pytest.approx(0.25 * COUNT, rel=0.15)
    assert set(lost) == set(uncontrollable_losses(PLATFORM, 2))
    for count in lost.values():
        assert count == pytest.approx(0.75 * COUNT / len(lost), rel=0.35)


def test_robots_without_uncontrollable_failures_lose_whatever_may_fail():
    loses = Actuation(failures=1, failure_chance=1.0)
    plain, asked = (replace(STILL, actuation=each) for each in (loses, replace(loses, **UNCONTROLLABLE)))
    np.testing.assert_array_equal(worlds(asked, BOAT).alive, worlds(plain, BOAT).alive)


def test_uncontrollable_failures_need_failures():
    with pytest.raises(ValueError, match="needs 'failures'"):
        Actuation(**UNCONTROLLABLE)


def test_a_robot_with_fewer_actuators_than_may_fail_can_lose_all():
    alive = worlds(replace(STILL, actuation=Actuation(failures=5, failure_chance=1.0)), BOAT).alive
    assert not alive.any()


def test_delays_and_losses_lie_between_nothing_and_the_most():
    world = worlds(ALL)
    fills(world.action_delay, 0.0, 0.04)
    fills(world.action_noise, 0.0, 0.05)
    fills(world.sensor_delay, 0.0, 0.1)
    fills(world.dropout, 0.0, 0.2)


def test_biases_have_a_standard_deviation_of_one_times_their_factor():
    world = worlds(ALL)
    for rows in (world.sensor_bias, world.sensor_scale):
        assert rows.shape == (6, COUNT)
        np.testing.assert_allclose(rows.std(axis=1), 2.0, rtol=0.08)
        np.testing.assert_allclose(rows.mean(axis=1), 0.0, atol=4 * 2.0 / np.sqrt(COUNT))


def test_a_world_of_a_batch_is_picked_written_and_cast_whole():
    many, other = worlds(ALL, count=4), worlds(ALL, count=1, seed=8)
    one = many[2]
    assert (one.gain.shape, one.mass) == ((8,), many.mass[2])
    many.write([1], other)
    assert many.mass[1] == other.mass[0]
    assert many.gain[:, 1].tolist() == other.gain[:, 0].tolist()
    assert many.mass[2] == one.mass
    cast = many.mapped(lambda array: array.astype(np.float32))
    assert {getattr(cast, name).dtype for name in FIELDS} == {np.dtype(np.float32)}


@pytest.mark.parametrize(
    ("actuation", "words"),
    [
        (
            Actuation(delay_s=0.15, opening_delay_s=(0.0, 0.1)),
            "up to 0.25 s late .* at most one control step, 0.2 s of 'floating_platform'",
        ),
        (Actuation(opening_delay_s=(0.0, 0.3)), "up to 0.3 s late"),
    ],
)
def test_what_a_robot_cannot_have_is_refused_instead_of_cut(actuation, words):
    with pytest.raises(ConfigError, match=words):
        worlds(replace(STILL, actuation=actuation))


def test_docs_state_of_every_entry():
    text = (Path(__file__).parents[3] / "docs/scenarios.md").read_text(encoding="utf-8")
    names = {field.name for part in (Scenario, *PARTS.values()) for field in fields(part)}
    assert {name for name in names if f"`{name}`" not in text} == set()


def test_the_air_bearing_is_late_within_its_span_and_the_same_for_one_seed():
    scenario = replace(STILL, bearing_late_s=(1.0, 3.0))
    late_s = [bearing_late_s(scenario, seed=4, number=number) for number in range(200)]
    fills(np.array(late_s), 1.0, 3.0)
    assert late_s == [bearing_late_s(scenario, seed=4, number=number) for number in range(200)]
    assert bearing_late_s(STILL, seed=4, number=0) == 0.0


def test_an_orbit_is_that_of_every_world_in_space_and_off_by_default():
    craft, found = load_robot("spacecraft_16"), []
    for scenario in (STILL, replace(STILL, orbit_rate=0.001)):
        draws = Draws(7, np.arange(3), np.zeros(3), WORLD)
        found.append(draw_spatial_world(craft, scenario, draws))
    assert found[0].orbit_rate.tolist() == [0.0] * 3
    assert found[1].orbit_rate.tolist() == [0.001] * 3
    names = [name for name in found[0].names() if not np.array_equal(*(getattr(w, name) for w in found))]
    assert names == ["orbit_rate"]
    with pytest.raises(ValueError, match=r"'orbit_rate' = -0\.001 rad/s must not be negative"):
        replace(STILL, orbit_rate=-0.001)
