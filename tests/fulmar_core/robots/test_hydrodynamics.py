"""Forces of the water in the plane and in six degrees of freedom are one model."""

from __future__ import annotations

import numpy as np
import pytest

from fulmar_core.robots.hydrodynamics import Hydrodynamics, Hydrostatics
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.states.gravity import GRAVITY

WATER = load_robot("kingfisher").hydrodynamics
LADEN = Hydrodynamics(
    WATER.linear_damping, WATER.quadratic_damping, (4.0, 20.0, 25.0, 1.0, 2.0, 3.0), WATER.hydrostatics
)
UP = np.array([0.0, 0.0, 1.0])
WEIGHT = np.asarray(35.0 * GRAVITY)


def in_plane(u, v, r):
    return np.array([u, v, 0.0, 0.0, 0.0, r])


def test_drag_in_the_plane_is_part_of_the_drag_in_six_degrees():
    six = WATER.damping(in_plane(1.2, -0.3, 0.4))
    plane = WATER.planar_damping(*(np.asarray(value) for value in (1.2, -0.3, 0.4)))
    np.testing.assert_allclose(six[[0, 1, 5]], plane)
    np.testing.assert_array_equal(six[2:5], 0.0)


def test_drag_always_takes_energy():
    velocity = np.random.default_rng(1).normal(size=(200, 6))
    assert (WATER.damping(velocity) * velocity <= 0.0).all()


def test_without_added_mass_a_wrench_is_felt_as_it_is():
    wrench = np.arange(6.0)
    felt = WATER.with_added_mass(wrench, np.ones(6), np.array([35.0]), np.array([3.0, 5.0, 8.0]))
    np.testing.assert_array_equal(felt, wrench)


def test_added_mass_makes_the_hull_accelerate_as_its_whole_mass_does():
    mass, inertia = np.array([35.0]), np.array([3.0, 5.0, 8.0])
    wrench = np.array([10.0, 10.0, 10.0, 1.0, 1.0, 1.0])
    felt = LADEN.with_added_mass(wrench, np.zeros(6), mass, inertia)
    whole = np.concatenate((mass, mass, mass, inertia)) + LADEN.added_mass
    np.testing.assert_allclose(felt / np.concatenate((mass, mass, mass, inertia)), wrench / whole)


def test_a_hull_that_drifts_askew_is_turned_across_its_way():
    """Munk's moment: water that moves along sideways but hardly ahead turns the hull broadside."""
    mass, inertia = np.array([35.0]), np.array([3.0, 5.0, 8.0])
    felt = LADEN.with_added_mass(np.zeros(6), in_plane(1.0, 0.2, 0.0), mass, inertia)
    assert felt[5] * (8.0 + 3.0) / 8.0 == pytest.approx((4.0 - 20.0) * 1.0 * 0.2)


def test_added_mass_neither_gives_nor_takes_energy():
    """Power on body and water together is that of the wrench: the Coriolis terms do no work (Fossen, property 6.2)."""
    rng = np.random.default_rng(2)
    mass, inertia = np.array([35.0]), np.array([3.0, 5.0, 8.0])
    own = np.concatenate((mass, mass, mass, inertia))
    for _ in range(20):
        velocity, wrench = rng.normal(size=6), rng.normal(size=6)
        v, omega = velocity[:3], velocity[3:]
        of_body = np.concatenate((mass * np.cross(omega, v), np.cross(omega, inertia * omega)))
        acceleration = (LADEN.with_added_mass(wrench, velocity, mass, inertia) - of_body) / own
        power = ((own + LADEN.added_mass) * acceleration) @ velocity
        assert power == pytest.approx(wrench @ velocity)


def test_buoyancy_carries_the_weight_at_rest_and_more_the_deeper_the_hull_is():
    hydrostatics = WATER.hydrostatics
    force, moment = hydrostatics.wrench(np.asarray(0.0), UP, WEIGHT)
    assert force == WEIGHT
    np.testing.assert_array_equal(moment, 0.0)
    deeper, _ = hydrostatics.wrench(np.asarray(-0.01), UP, WEIGHT)
    assert deeper - WEIGHT == pytest.approx(
        hydrostatics.water_density * GRAVITY * hydrostatics.waterplane_area * 0.01
    )


def test_water_never_pulls_a_hull_down():
    force, _ = WATER.hydrostatics.wrench(np.asarray(1.0), UP, WEIGHT)
    assert force == 0.0


@pytest.mark.parametrize(("axis", "height"), [(0, 0.40), (1, 0.52)], ids=["roll", "pitch"])
def test_a_heeled_hull_is_righted_by_its_metacentric_height(axis, height):
    angle = 0.1
    up = {0: [0.0, np.sin(angle), np.cos(angle)], 1: [-np.sin(angle), 0.0, np.cos(angle)]}[axis]
    _, moment = WATER.hydrostatics.wrench(np.asarray(0.0), np.array(up), WEIGHT)
    assert moment[axis] == pytest.approx(-WEIGHT * height * np.sin(angle))


def test_hulls_that_would_sink_or_capsize_are_refused():
    with pytest.raises(ValueError, match="capsize"):
        Hydrostatics(997.0, 0.33, 0.1, -0.1, 0.5)
    with pytest.raises(ValueError, match="must not be negative"):
        Hydrodynamics((-1.0, *[0.0] * 5), (0.0,) * 6, (0.0,) * 6, WATER.hydrostatics)
