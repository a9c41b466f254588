"""The boat on the water: it floats, rights itself, rings as its YAML says, and is slowed by drag."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.robots.robot_file import load_robot
from fulmar_core.states.gravity import GRAVITY

mujoco = pytest.importorskip("mujoco")

from sim_nodes.mujoco_backend import MujocoBackend  # noqa: E402

BOAT = load_robot("kingfisher")
WATER = BOAT.hydrodynamics
TANK = replace(  # without drag, so that it rings on
    BOAT, hydrodynamics=replace(WATER, linear_damping=(0.0,) * 6, quadratic_damping=(0.0,) * 6)
)
STOPPED = np.zeros(2)


def afloat(robot, episode, **world):
    backend = MujocoBackend(robot, sensor_noise=False)
    backend.reset(episode(robot, **world), seed=0)
    return backend


@pytest.mark.parametrize("mass", [33.0, 35.0, 37.0])
def test_at_rest_it_stays_at_rest_whatever_it_weighs(episode, mass):
    truth = afloat(BOAT, episode, mass=mass).step(STOPPED, 500).truth
    np.testing.assert_allclose(truth.position_in_world, 0.0, atol=1e-9)
    np.testing.assert_allclose(truth.quat_xyzw, [0.0, 0.0, 0.0, 1.0], atol=1e-9)


def test_the_draught_of_the_yaml_is_what_its_weight_displaces():
    hydrostatics = WATER.hydrostatics
    displaced = hydrostatics.water_density * hydrostatics.waterplane_area * hydrostatics.draught
    assert displaced == pytest.approx(BOAT.body.mass, rel=1e-3)


def period_of(robot, episode, coordinate, size):
    """Time between the first two falls of a coordinate through zero, once it was pushed off its rest [s]."""
    backend = afloat(robot, episode)
    if coordinate == "heave":
        backend.data.qpos[2] += size
    else:
        axis = {"roll": 0, "pitch": 1}[coordinate]
        backend.data.qpos[3:7] = (np.cos(0.5 * size), *(np.sin(0.5 * size) * np.eye(3)[axis]))
    values = []
    for _ in range(400):
        truth = backend.step(STOPPED).truth
        if coordinate == "heave":
            values.append(truth.position_in_world[2])
        else:
            values.append(truth.quat_xyzw[axis])
    falls = [k for k in range(1, 400) if values[k - 1] > 0.0 >= values[k]]
    return (falls[1] - falls[0]) * robot.timing.physics_dt


@pytest.mark.parametrize(
    ("coordinate", "stiffness", "inertia"),
    [
        (
            "heave",
            WATER.hydrostatics.water_density * GRAVITY * WATER.hydrostatics.waterplane_area,
            BOAT.body.mass,
        ),
        ("roll", BOAT.body.mass * GRAVITY * WATER.hydrostatics.metacentric_height_roll, BOAT.body.inertia[0]),
        (
            "pitch",
            BOAT.body.mass * GRAVITY * WATER.hydrostatics.metacentric_height_pitch,
            BOAT.body.inertia[1],
        ),
    ],
)
def test_it_rings_with_the_period_of_its_stiffness_and_inertia(episode, coordinate, stiffness, inertia):
    period = period_of(TANK, episode, coordinate, 0.03)
    assert period == pytest.approx(2.0 * np.pi * np.sqrt(inertia / stiffness), abs=0.03)  # a tick and a half


def test_added_mass_slows_the_ringing(episode):
    laden = replace(
        TANK, hydrodynamics=replace(TANK.hydrodynamics, added_mass=(0.0, 0.0, 35.0, 0.0, 0.0, 0.0))
    )
    slower = period_of(laden, episode, "heave", 0.03) / period_of(TANK, episode, "heave", 0.03)
    assert slower == pytest.approx(np.sqrt(2.0), abs=0.06)


def test_waves_of_its_own_die_down(episode):
    backend = afloat(BOAT, episode)
    backend.data.qpos[2], backend.data.qpos[3:7] = 0.05, (np.cos(0.1), np.sin(0.1), 0.0, 0.0)
    truth = backend.step(STOPPED, 1000).truth
    assert abs(truth.position_in_world[2]) < 1e-3
    np.testing.assert_allclose(truth.quat_xyzw[:2], 0.0, atol=2e-3)


def test_a_hull_out_of_the_water_falls_freely(episode):
    backend = afloat(BOAT, episode)
    backend.data.qpos[2] = 1.0
    truth = backend.step(STOPPED, 5).truth
    expected = -GRAVITY * 0.1
    assert truth.velocity_in_world[2] == pytest.approx(expected, rel=0.2)  # drag acts in the air too


def test_full_ahead_it_reaches_the_speed_where_drag_equals_thrust(episode):
    backend = afloat(BOAT, episode)
    truth = backend.step(np.ones(2), 2000).truth
    thrust = 2.0 * BOAT.actuators.curve[-1]
    assert truth.velocity_in_world[0] == pytest.approx(np.sqrt(thrust / WATER.quadratic_damping[0]), rel=1e-3)


def test_nothing_happens_in_the_dead_band_and_slew_delays_the_rest(episode):
    backend = afloat(BOAT, episode)
    assert backend.step(np.array([0.2, 0.2]), 100).truth.velocity_in_world[0] == 0.0
    backend = afloat(BOAT, episode)
    backend.step(np.ones(2), 10)  # 0.2 s at one unit a second
    assert backend.data.ctrl.max() <= BOAT.actuators.thrust(np.array([0.2]))[0] + 1e-9


def test_a_current_of_wind_pushes_it_sideways_at_its_drag_s_price(episode):
    backend = afloat(BOAT, episode, force_y=10.0)
    speed = backend.step(STOPPED, 1500).truth.velocity_in_world[1]
    assert (99.99 + 99.99 * speed) * speed == pytest.approx(10.0, rel=0.01)


def test_drag_grows_with_its_factor(episode):
    slow = afloat(BOAT, episode, drag=1.1).step(np.ones(2), 1000).truth.velocity_in_world[0]
    fast = afloat(BOAT, episode, drag=0.9).step(np.ones(2), 1000).truth.velocity_in_world[0]
    assert fast / slow == pytest.approx(np.sqrt(1.1 / 0.9), rel=0.01)
