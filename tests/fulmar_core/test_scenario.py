"""Disturbances, drawn once an episode."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.disturbances.scenario import draw_world, load_scenario
from fulmar_core.errors import UnknownNameError
from fulmar_core.robot import load_robot

ROBOT = load_robot("floating_platform")


def worlds(scenario, count=500):
    return [draw_world(ROBOT, scenario, np.random.default_rng(i)) for i in range(count)]


def test_the_ideal_world_is_the_nominal_body_in_stillness():
    world = worlds(load_scenario("ideal"), 1)[0]
    assert (world.mass, world.inertia) == (ROBOT.body.mass, ROBOT.body.inertia)
    assert np.abs([*world.force_in_world, *world.torque_in_world]).max() == 0.0


def test_an_uncertain_body_covers_its_whole_span_and_never_leaves_it():
    drawn = worlds(load_scenario("uncertain"))
    for values, (low, high) in (
        (np.array([w.mass for w in drawn]), ROBOT.uncertainty.mass),
        (np.array([w.inertia[2] for w in drawn]), ROBOT.uncertainty.yaw_inertia),
    ):
        assert low <= values.min() < low + 0.02 * (high - low)  # 500 draws miss 2 % with a chance of 4e-5
        assert high - 0.02 * (high - low) < values.max() <= high


def test_mass_and_inertia_are_drawn_apart():
    drawn = worlds(load_scenario("uncertain"))
    correlation = np.corrcoef([w.mass for w in drawn], [w.inertia[2] for w in drawn])[0, 1]
    assert abs(correlation) < 0.18  # four sigma of 500 independent pairs


def test_forces_point_everywhere_in_the_plane_and_stay_below_the_limit():
    scenario = load_scenario("uncertain")
    drawn = worlds(scenario)
    force = np.array([w.force_in_world for w in drawn])
    size = np.linalg.norm(force, axis=1)
    assert 0.9 * scenario.max_force < size.max() <= scenario.max_force
    assert not force[:, 2].any()
    assert {(x > 0, y > 0) for x, y, _ in force} == {(a, b) for a in (True, False) for b in (True, False)}


def test_torques_have_both_signs_about_z_only():
    scenario = load_scenario("uncertain")
    torque = np.array([w.torque_in_world for w in worlds(scenario)])
    assert not torque[:, :2].any()
    assert -scenario.max_torque <= torque[:, 2].min() < -0.9 * scenario.max_torque
    assert 0.9 * scenario.max_torque < torque[:, 2].max() <= scenario.max_torque


def test_every_scenario_takes_the_same_number_of_draws():
    after = []
    for name in ("ideal", "nominal", "uncertain"):
        rng = np.random.default_rng(7)
        draw_world(ROBOT, load_scenario(name), rng)
        after.append(rng.uniform())
    assert len(set(after)) == 1


def test_negative_magnitudes_are_refused():
    with pytest.raises(ValueError, match="must not be negative"):
        replace(load_scenario("ideal"), max_force=-1.0)
    with pytest.raises(ValueError, match="must not be negative"):
        replace(load_scenario("ideal"), max_torque=-1.0)


def test_an_unknown_scenario_gets_the_nearest_name():
    with pytest.raises(UnknownNameError, match=r"^unknown scenario 'nominall'\. Did you mean 'nominal'\?$"):
        load_scenario("nominall")
