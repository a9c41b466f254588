"""Bodies that float on air or water: what has a closed form, and what may not change."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.dynamics.free_body import free_body_step
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.states.counter_rng import WORLD, Draws
from fulmar_core.states.planar import PlanarState, at_rest
from fulmar_core.worlds.scenario import draw_world, load_scenario

BOAT = load_robot("kingfisher")
CALM = (np.zeros(1),) * 3
WORLD_OF_ONE = draw_world(BOAT, load_scenario("ideal"), Draws.of_episode(0, 0, stream=WORLD))
SIX = (0.0,) * 6
WATER = BOAT.hydrodynamics
ROUNDING = 1e-12


def state(**values):
    return PlanarState(*(np.array([values.get(name, 0.0)]) for name in PlanarState.__slots__))


def push(ahead=0.0, left=0.0, moment=0.0):
    return np.array([ahead]), np.array([left]), np.array([moment])


def moved(body, *, by=CALM, outside=CALM, water=None, dt=0.01, steps=1, world=WORLD_OF_ONE):
    for _ in range(steps):
        body = free_body_step(body, by, outside, world, water, dt)
    return body


def dry(**kwargs):
    return replace(WATER, **{"linear_damping": SIX, "quadratic_damping": SIX, "added_mass": SIX, **kwargs})


def test_a_constant_force_gives_the_semi_implicit_sum_of_a_double_integrator():
    dt, n, mass = 0.01, 50, WORLD_OF_ONE.mass[0]
    after = moved(state(yaw=np.pi / 2, vx=0.1), by=push(ahead=2.0), dt=dt, steps=n)
    a = 2.0 / mass
    assert after.vy[0] == pytest.approx(a * n * dt, abs=ROUNDING)
    assert after.y[0] == pytest.approx(a * dt * dt * n * (n + 1) / 2, abs=ROUNDING)
    assert after.x[0] == pytest.approx(0.1 * n * dt, abs=ROUNDING)


def test_a_constant_moment_turns_by_the_same_sum():
    dt, n, izz = 0.01, 50, WORLD_OF_ONE.yaw_inertia[0]
    after = moved(state(yaw_rate=0.2), by=push(moment=0.5), dt=dt, steps=n)
    assert after.yaw_rate[0] == pytest.approx(0.2 + 0.5 / izz * n * dt, abs=ROUNDING)
    assert after.yaw[0] == pytest.approx(0.2 * n * dt + 0.5 / izz * dt * dt * n * (n + 1) / 2, abs=ROUNDING)


def test_an_outside_force_stays_in_the_world_however_the_body_points():
    for water in (None, dry()):
        for yaw in (0.0, 1.0, 2.5):
            after = moved(state(yaw=yaw), outside=push(1.0, -2.0, 0.1), water=water)
            mass = WORLD_OF_ONE.mass[0]
            assert [after.vx[0] * mass, after.vy[0] * mass] == pytest.approx([0.01, -0.02], abs=ROUNDING)


def test_without_forces_a_spinning_body_keeps_its_velocity_and_energy_exactly():
    before = state(vx=0.3, vy=-0.2, yaw_rate=0.9)
    after = moved(before, steps=1000)
    assert (after.vx[0], after.vy[0], after.yaw_rate[0]) == (0.3, -0.2, 0.9)


def test_a_body_in_water_without_damping_or_added_mass_is_a_body_on_air():
    wet = moved(state(vx=0.3, vy=-0.2, yaw_rate=0.9), by=push(1.0, 2.0, 0.3), water=dry(), steps=100)
    air = moved(state(vx=0.3, vy=-0.2, yaw_rate=0.9), by=push(1.0, 2.0, 0.3), steps=100)
    for name in PlanarState.__slots__:
        np.testing.assert_allclose(getattr(wet, name), getattr(air, name), rtol=0, atol=ROUNDING)


def impulse(body, water):
    """Kelvin's impulse in the world: linear along x and y, and angular about the origin; and the energy."""
    mu, mv, ir = water.planar_added_mass
    mass, izz = WORLD_OF_ONE.mass + mu, WORLD_OF_ONE.yaw_inertia + ir
    u, v = body.velocity_in_body
    r, side = body.yaw_rate, WORLD_OF_ONE.mass + mv
    c, s = np.cos(body.yaw), np.sin(body.yaw)
    px, py = c * mass * u - s * side * v, s * mass * u + c * side * v
    turn = izz * r + body.x * py - body.y * px
    return np.array([px, py, turn, 0.5 * (mass * u * u + side * v * v + izz * r * r)])[:, 0]


def test_in_still_water_the_impulse_of_hull_and_added_mass_is_kept_in_the_world():
    # Kirchhoff's equations of a body in an ideal fluid keep it; only the first-order steps lose some.
    water = dry(added_mass=(3.0, 40.0, 0.0, 0.0, 0.0, 5.0))
    before = state(vx=0.5, vy=0.3, yaw_rate=0.4, yaw=0.7)
    drift = []
    for dt in (0.002, 0.001):
        after = moved(before, water=water, dt=dt, steps=round(3.0 / dt))
        assert (
            np.hypot(after.vx - before.vx, after.vy - before.vy)[0] > 0.05
        )  # the velocity itself is not kept
        drift.append(np.abs(impulse(after, water) - impulse(before, water)))
    assert np.all(drift[1] < 2e-3 * np.abs(impulse(before, water)).max())
    np.testing.assert_allclose(drift[0] / drift[1], 2.0, rtol=0.1)


def test_added_mass_makes_a_hull_slower_to_start_along_each_axis():
    water = dry(added_mass=(10.0, 20.0, 0.0, 0.0, 0.0, 5.0))
    mass, izz = WORLD_OF_ONE.mass[0], WORLD_OF_ONE.yaw_inertia[0]
    after = moved(state(), by=push(1.0, 1.0, 1.0), water=water)
    assert [after.vx[0], after.vy[0], after.yaw_rate[0]] == pytest.approx(
        [0.01 / (mass + 10.0), 0.01 / (mass + 20.0), 0.01 / (izz + 5.0)], abs=ROUNDING
    )


def test_a_slender_hull_that_drifts_is_turned_broadside_by_its_added_mass():
    # The Munk moment (m_u - m_v) u v: ahead and to the left turns the bow right where sway adds more than surge.
    after = moved(state(vx=0.5, vy=0.1), water=dry(added_mass=(0.0, 30.0, 0.0, 0.0, 0.0, 0.0)))
    assert after.yaw_rate[0] == pytest.approx(
        -30.0 * 0.5 * 0.1 * 0.01 / WORLD_OF_ONE.yaw_inertia[0], abs=ROUNDING
    )


def test_damping_only_ever_takes_energy_away():
    for seed in range(20):
        u, v, r = np.random.default_rng(seed).normal(size=3)
        drag = WATER.planar_damping(np.asarray(u), np.asarray(v), np.asarray(r))
        assert float(drag[0] * u + drag[1] * v + drag[2] * r) < 0.0


def test_the_boat_reaches_the_top_speed_where_drag_equals_full_thrust():
    after = moved(at_rest(*np.zeros((3, 1))), by=push(39.0), water=WATER, dt=0.02, steps=2000)
    assert after.vx[0] == pytest.approx(BOAT.performance.top_speed, rel=0.01)


def test_more_drag_makes_a_boat_slower():
    world = replace(WORLD_OF_ONE, drag=np.array([1.21]))
    slow = moved(state(), by=push(39.0), water=WATER, dt=0.02, steps=2000, world=world)
    fast = moved(state(), by=push(39.0), water=WATER, dt=0.02, steps=2000)
    assert slow.vx[0] * 1.1 == pytest.approx(fast.vx[0], rel=1e-6)


@pytest.mark.parametrize("wet", [False, True])
def test_each_body_of_a_batch_moves_as_it_would_alone(wet):
    rng, n = np.random.default_rng(3), 4
    water = replace(WATER, added_mass=(3.0, 40.0, 0.0, 0.0, 0.0, 5.0)) if wet else None
    crowd, by, outside = (tuple(rng.normal(size=(k, n))) for k in (6, 3, 3))
    world = draw_world(BOAT, load_scenario("uncertain"), Draws(1, np.arange(n), np.zeros(n), WORLD))
    together = free_body_step(PlanarState(*crowd), by, outside, world, water, 0.02)
    for i in range(n):
        alone = free_body_step(
            PlanarState(*crowd)[i],
            tuple(p[i] for p in by),
            tuple(p[i] for p in outside),
            world[i],
            water,
            0.02,
        )
        for name in PlanarState.__slots__:
            np.testing.assert_allclose(
                getattr(alone, name), getattr(together, name)[i], rtol=0, atol=ROUNDING
            )


def test_water_that_pushes_is_refused():
    with pytest.raises(ValueError, match="damping and added mass must not be negative"):
        replace(WATER, linear_damping=(-1.0, *SIX[1:]))
    with pytest.raises(ValueError, match="would capsize"):
        replace(WATER.hydrostatics, metacentric_height_roll=0.0)
