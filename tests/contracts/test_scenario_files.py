"""What every scenario's YAML promises, and those of the DRIFT benchmark above all."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.config.paths import config_names
from fulmar_core.loop.rollout import roll_out_in_batch
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.episode import draw_episodes
from fulmar_core.simulation.metrics import episode_metrics
from fulmar_core.states.counter_rng import WORLD, Draws
from fulmar_core.states.planar import PlanarState
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import draw_world, load_scenario
from fulmar_core.worlds.world import FIELDS

PLATFORM, TASK = load_robot("floating_platform"), load_task("drift_go_to_pose")
SCENARIOS = {name: load_scenario(name) for name in config_names("scenarios")}
OF_OTHER_ROBOTS = {
    "surface_stuck",
    "wheel_dead",
    "propeller_lost",
    "morphologies",
}  # that the platform has not
EACH = pytest.mark.parametrize("name", [name for name in SCENARIOS if name not in OF_OTHER_ROBOTS])
COUNT = 256

# Thesis Table 3.5: velocity noise [m/s], force [N], torque [N·m], thrusters lost.
ROWS = {
    "drift_ideal": (0.0, 0.0, 0.0, 0),
    "drift_velocity_noise_2": (0.02, 0.0, 0.0, 0),
    "drift_velocity_noise_4": (0.04, 0.0, 0.0, 0),
    "drift_torque": (0.0, 0.0, 0.05, 0),
    "drift_force_2": (0.0, 0.2, 0.0, 0),
    "drift_force_4": (0.0, 0.4, 0.0, 0),
    "drift_force_torque": (0.0, 0.2, 0.05, 0),
    "drift_one_lost": (0.0, 0.0, 0.0, 1),
    "drift_two_lost": (0.0, 0.0, 0.0, 2),
}
# What each of the others is about, and may therefore differ from the nominal robot in.
OTHERS = {
    "drift_action_noise": {"action_noise"},
    "drift_floor_wave": {"wave_force"},
    "lab_tether": {"tether_stiffness", "tether_x", "tether_y", "anchor_x", "anchor_y"},
    "lab_slope": {"force_x", "force_y"},
    "lab_mocap": {"noise", "sensor_delay", "dropout"},
    "lab_valves": {"gain", "opening_delay"},
}


def worlds(scenario, *, count=COUNT):
    return draw_world(PLATFORM, scenario, Draws(5, np.arange(count), np.zeros(count), WORLD))


def differing(scenario):
    """What differs from the nominal robot in a still world, with the same sensors."""
    calm = worlds(replace(SCENARIOS["ideal"], sensor_noise=scenario.sensor_noise))
    drawn = worlds(scenario)
    return {name for name in FIELDS if not np.array_equal(getattr(calm, name), getattr(drawn, name))}


class OneByOne:
    """Opens one valve after the other."""

    name, control_hz, estimator = "one after the other", 5.0, None
    readings, observer = (), None

    def reset(self):
        self.k = 0

    def act(self, inputs):
        self.k += 1
        return np.tile(np.eye(8)[self.k // 3 % 8], (len(inputs.previous), 1))


@pytest.mark.parametrize("name", SCENARIOS)
def test_it_has_a_title_of_its_own(name):
    assert [scenario.title for scenario in SCENARIOS.values()].count(SCENARIOS[name].title) == 1


@EACH
def test_its_worlds_are_finite_and_their_bodies_can_exist(name):
    world = worlds(SCENARIOS[name])
    for field in FIELDS:
        assert np.isfinite(getattr(world, field)).all(), field
    assert np.all(world.mass > 0.0)
    assert np.all(world.yaw_inertia > 0.0)


@EACH
def test_an_episode_of_it_has_every_figure_of_the_benchmark(name):
    task = replace(TASK, episode_s=4.0)
    run = roll_out_in_batch(OneByOne(), PLATFORM, task, SCENARIOS[name], episodes=3, seed=0)
    figures = episode_metrics(run, task)
    for centimetres, degrees in ((5, 5), (2, 2), (1, 1)):
        assert np.isfinite(figures[f"PT{centimetres}_percent"]).all()
        assert np.isfinite(figures[f"OT{degrees}_percent"]).all()
    assert np.all(figures["ALV_m_s"] > 0.0)
    assert np.all(figures["AAV_rad_s"] > 0.0)
    assert np.all(figures["AAS"] == figures["AAS"][0])  # what was commanded counts, whatever came of it


@pytest.mark.parametrize("name", ROWS)
def test_a_row_of_the_table_has_its_magnitudes_exactly_and_nothing_else(name):
    noise, force, torque, lost = ROWS[name]
    world, scenario = worlds(SCENARIOS[name]), SCENARIOS[name]
    assert not scenario.sensor_noise
    np.testing.assert_array_equal(world.velocity_noise, noise)
    np.testing.assert_array_equal(world.yaw_rate_noise, noise)
    np.testing.assert_allclose(np.hypot(world.force_x, world.force_y), force, atol=1e-9)
    np.testing.assert_allclose(np.abs(world.torque), torque, atol=1e-9)
    np.testing.assert_array_equal(8 - world.alive.sum(axis=0), lost)
    meant = {"velocity_noise", "yaw_rate_noise", "force_x", "force_y", "torque", "alive"}
    assert differing(scenario) <= meant
    np.testing.assert_array_equal(world.mass, 5.32)
    np.testing.assert_array_equal(world.yaw_inertia, 0.2045)


def test_forces_come_from_everywhere_torques_from_both_sides_and_every_valve_is_lost_at_some_time():
    world = worlds(SCENARIOS["drift_force_torque"])
    assert len({(x > 0, y > 0) for x, y in zip(world.force_x, world.force_y, strict=True)}) == 4
    assert 0.4 < np.mean(world.torque > 0.0) < 0.6
    lost = 1.0 - worlds(SCENARIOS["drift_two_lost"]).alive
    np.testing.assert_allclose(lost.mean(axis=1), 0.25, atol=0.1)


@pytest.mark.parametrize("name", OTHERS)
def test_a_condition_beside_the_table_differs_in_what_it_is_about_alone(name):
    assert differing(SCENARIOS[name]) == OTHERS[name]


@pytest.mark.parametrize("name", ["drift_action_noise", "drift_floor_wave"])
def test_conditions_beside_the_table_are_exact_as_well(name):
    world = worlds(SCENARIOS[name])
    size = world.action_noise if name == "drift_action_noise" else world.wave_force
    assert len(np.unique(size)) == 1


def test_training_has_every_kind_of_disturbance_of_the_table_from_nothing_on():
    world = worlds(SCENARIOS["drift_training"], count=4000)
    size = np.hypot(world.force_x, world.force_y)
    for values, most in ((size, 0.3), (np.abs(world.torque), 0.155 * 0.31), (world.velocity_noise, 0.003)):
        assert values.min() < 0.01 * most
        assert 0.99 * most < values.max() <= most * (1.0 + 1e-9)
    lost = 8 - world.alive.sum(axis=0)
    assert set(lost) == {0.0, 1.0, 2.0}
    assert np.mean(1.0 - world.alive) == pytest.approx(1.0 / 8.0, abs=0.01)


def test_every_condition_starts_from_the_same_places_3_to_4_m_away_at_rest():
    drawn = [
        draw_episodes(PLATFORM, TASK, SCENARIOS[name], seed=9, numbers=np.arange(COUNT))
        for name in (*ROWS, *OTHERS)
    ]
    for each in drawn[1:]:
        for column in PlanarState.COLUMNS:
            np.testing.assert_array_equal(getattr(each.start, column), getattr(drawn[0].start, column))
        np.testing.assert_array_equal(each.goal.current, drawn[0].goal.current)
    start, goal = drawn[0].start, drawn[0].goal.current
    distance = np.hypot(start.x - goal[:, 0], start.y - goal[:, 1])
    assert 3.0 <= distance.min() < 3.05
    assert 3.95 < distance.max() <= 4.0
    assert not start.vx.any() and not start.vy.any() and not start.yaw_rate.any()
    assert len({(np.cos(yaw) > 0, np.sin(yaw) > 0) for yaw in start.yaw - goal[:, 2]}) == 4
