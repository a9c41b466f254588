"""Openings for a wrench that is asked for in shares: exact figures of known layouts, and the torque first."""

from __future__ import annotations

import numpy as np
import pytest

from fulmar_core.controllers.wrench_shares import WrenchShares, body_terms, effect_of
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.states.counter_rng import WORLD, Draws
from fulmar_core.worlds.shaped_world import draw_bodies

ROBOT = load_robot("cubesat_8")


def wrench(effect, openings):
    return np.einsum("...ij,...j->...i", effect, openings)


def test_limits_are_those_of_the_layout():
    # Four nozzles of 1 N at 45° push along x and y, eight along z, all in pairs, with arms of 5 cm.
    root = np.sqrt(2.0)
    found = WrenchShares.of_robot(ROBOT)
    np.testing.assert_allclose(
        found.limits, [root, root, 2.0 * root, 0.05 * root, 0.05 * root, 0.1 * root], rtol=1e-9
    )
    np.testing.assert_allclose(found.resting, 1.0, rtol=1e-9)
    mass, inertia = ROBOT.body.mass, np.array(ROBOT.body.inertia)
    np.testing.assert_allclose(body_terms(ROBOT), found.limits / [mass, mass, mass, *inertia])


@pytest.mark.parametrize("name", ["cubesat_8", "int_ball2"])
@pytest.mark.parametrize("axis", range(6))
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_whole_share_of_one_axis_is_made_exactly_and_opens_some_thruster_fully(name, axis, sign):
    robot = load_robot(name)
    found, shares = WrenchShares.of_robot(robot), sign * np.eye(6)[axis]
    openings = found.openings(shares)
    np.testing.assert_allclose(wrench(effect_of(robot), openings), shares * found.limits, atol=1e-9)
    assert openings.min() >= 0.0
    assert openings.max() == pytest.approx(1.0, abs=0.35)


def test_what_can_be_made_is_made_exactly():
    rng = np.random.default_rng(1)
    shares = 0.12 * rng.uniform(-1.0, 1.0, (64, 6))
    found = WrenchShares.of_robot(ROBOT)
    np.testing.assert_allclose(
        wrench(effect_of(ROBOT), found.openings(shares)), shares * found.limits, atol=1e-12
    )


def test_the_torque_comes_first_and_neither_changes_its_direction():
    effect = draw_bodies(ROBOT, Draws(1, np.arange(64), np.zeros(64, int), WORLD)).effect
    found = WrenchShares.of(effect)
    shares = np.random.default_rng(2).uniform(-1.0, 1.0, (64, 6))
    openings, asked = found.openings(shares), shares * found.limits
    assert openings.min() >= 0.0
    assert openings.max() <= 1.0
    made = wrench(effect, openings)
    force, torque = (
        np.linalg.norm(made[:, part], axis=1) / np.linalg.norm(asked[:, part], axis=1)
        for part in (slice(0, 3), slice(3, 6))
    )
    np.testing.assert_allclose(made[:, :3], force[:, None] * asked[:, :3], atol=1e-12)
    np.testing.assert_allclose(made[:, 3:], torque[:, None] * asked[:, 3:], atol=1e-12)
    assert torque.min() > 0.4, "three whole shares at once are beyond the body"
    alone = found.openings(shares * [0, 0, 0, 1, 1, 1])
    np.testing.assert_allclose(wrench(effect, alone)[:, 3:], made[:, 3:], atol=1e-12)
    assert (force < 1.0 - 1e-9).any(), "a force gives way to the torque"


def test_bodies_side_by_side_get_the_openings_of_each_alone():
    effect = draw_bodies(ROBOT, Draws(1, np.arange(5), np.zeros(5, int), WORLD)).effect
    shares = np.random.default_rng(3).uniform(-1.0, 1.0, (5, 6))
    together = WrenchShares.of(effect).openings(shares)
    alone = [WrenchShares.of(effect[i]).openings(shares[i]) for i in range(5)]
    np.testing.assert_allclose(together, alone, atol=1e-12)


def test_a_force_does_not_turn_a_body_whose_centre_of_mass_lies_aside():
    robot = load_robot("int_ball2")
    actuators, openings = robot.actuators, WrenchShares.of_robot(robot).openings(0.5 * np.eye(6)[0])
    force, torque = (np.asarray(part) for part in actuators.wrench_in_body(openings))
    assert np.linalg.norm(torque) > 1e-5, "about the body's origin"
    np.testing.assert_allclose(torque, np.cross(robot.body.com, force), atol=1e-12)


def test_nothing_asked_for_opens_nothing():
    assert not WrenchShares.of_robot(ROBOT).openings(np.zeros(6)).any()


@pytest.mark.parametrize("name", ["spacecraft_16", "floating_platform"])
def test_valves_on_one_line_are_refused(name):
    with pytest.raises(ValueError, match="must open by degrees and share no pressure line"):
        WrenchShares.of_robot(load_robot(name))


def test_thrusters_that_do_not_balance_one_another_are_refused():
    effect = effect_of(ROBOT).copy()
    effect[:, 0] = 0.0
    effect[2] = 1.0
    with pytest.raises(ValueError, match="do not balance one another"):
        WrenchShares.of(effect)
