"""Bodies on wheels: they go where they point, as fast as motors and friction let them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.dynamics.rolling import rolling_step
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.states.counter_rng import WORLD, Draws
from fulmar_core.states.gravity import GRAVITY
from fulmar_core.states.planar import PlanarState
from fulmar_core.worlds.scenario import draw_world, load_scenario

BASE, CAR = load_robot("turtlebot2"), load_robot("leatherback")
CALM = (np.zeros(1),) * 3
DT = 0.02


def rolled(robot, speed, second, *, steps=100, start=None, outside=CALM, gain=(1.0, 1.0), dt=DT):
    """States after each step under one target."""
    world = draw_world(robot, load_scenario("ideal"), Draws.of_episode(0, 0, stream=WORLD))
    state = start or PlanarState(*np.zeros((6, 1)))
    target, factor = np.array([[speed], [second]]), np.array([[gain[0]], [gain[1]]])
    states = []
    for _ in range(steps):
        state = rolling_step(state, target, factor, outside, world, robot.actuators, dt)
        states.append(state)
    return states


@pytest.mark.parametrize(("robot", "second"), [(BASE, 0.5), (CAR, 0.3)])
def test_no_wheel_ever_slips_sideways(robot, second):
    for state in rolled(robot, 0.4, second, outside=(np.array([3.0]), np.array([-5.0]), np.array([0.1]))):
        assert state.velocity_in_body[1][0] == pytest.approx(0.0, abs=1e-12)


def test_a_base_takes_up_the_speed_and_turn_rate_it_is_asked_for():
    end = rolled(BASE, 0.3, -0.6)[-1]
    assert end.velocity_in_body[0][0] == pytest.approx(0.3, abs=1e-6)
    assert end.yaw_rate[0] == pytest.approx(-0.6, abs=1e-6)


def test_a_servo_s_lag_leaves_a_third_of_the_way_after_its_time_constant():
    lag = BASE.actuators.response.lag_s
    speed = rolled(BASE, 0.05, 0.0, steps=round(lag / 0.001), dt=0.001)[-1].velocity_in_body[0][0]
    assert speed == pytest.approx(0.05 * (1.0 - np.exp(-1.0)), rel=0.02)


def test_motors_push_no_harder_than_they_can():
    weak = replace(BASE, actuators=replace(BASE.actuators, wheel_force=0.5))
    states = rolled(weak, 0.45, 0.9, steps=3)
    mass, izz = BASE.body.mass, BASE.body.inertia[2]
    for i, state in enumerate(states, start=1):
        assert state.velocity_in_body[0][0] == pytest.approx(2 * 0.5 / mass * i * DT, rel=1e-9)
        assert state.yaw_rate[0] == pytest.approx(0.5 * BASE.actuators.track / izz * i * DT, rel=1e-9)


def test_a_base_that_turns_while_it_drives_runs_a_circle_of_speed_over_turn_rate():
    states = rolled(BASE, 0.4, 0.8, steps=2000, dt=0.005)[400:]
    xy = np.array([(s.x[0], s.y[0]) for s in states])
    centre = 0.5 * (xy.max(axis=0) + xy.min(axis=0))
    np.testing.assert_allclose(np.linalg.norm(xy - centre, axis=1), 0.4 / 0.8, rtol=0.01)


def test_motors_hold_against_a_push_as_hard_as_they_can():
    held = rolled(BASE, 0.2, 0.0, outside=(np.array([-20.0]), np.zeros(1), np.array([-2.0])))[-1]
    assert held.velocity_in_body[0][0] == pytest.approx(0.2, abs=1e-6)
    assert held.yaw_rate[0] == pytest.approx(0.0, abs=1e-6)
    drive = BASE.actuators
    force, moment = 2.0 * drive.wheel_force + 3.0, drive.wheel_force * drive.track + 0.5
    pushed = rolled(BASE, 0.0, 0.0, outside=(np.array([force]), np.zeros(1), np.zeros(1)), steps=5)[-1]
    assert pushed.velocity_in_body[0][0] == pytest.approx(3.0 / BASE.body.mass * 5 * DT)
    spun = rolled(BASE, 0.0, 0.0, outside=(np.zeros(1), np.zeros(1), np.array([moment])), steps=5)[-1]
    assert spun.yaw_rate[0] == pytest.approx(0.5 / BASE.body.inertia[2] * 5 * DT)


def test_a_push_across_the_way_does_not_count():
    quiet = rolled(BASE, 0.0, 0.0)[-1]
    across = rolled(BASE, 0.0, 0.0, outside=(np.zeros(1), np.array([50.0]), np.zeros(1)))[-1]
    for name in PlanarState.__slots__:
        assert getattr(across, name)[0] == getattr(quiet, name)[0]


def test_worn_tyres_make_both_slower():
    end = rolled(BASE, 0.4, 0.5, gain=(0.9, 0.8))[-1]
    assert end.velocity_in_body[0][0] == pytest.approx(0.36, abs=1e-6)
    assert end.yaw_rate[0] == pytest.approx(0.4, abs=1e-6)


def test_a_car_runs_the_circle_of_its_wheelbase_and_steering_angle():
    end = rolled(CAR, 1.0, 0.3, steps=300)[-1]
    assert end.yaw_rate[0] == pytest.approx(np.tan(0.3) / CAR.actuators.wheelbase, rel=1e-3)


def test_a_car_that_stands_does_not_turn_and_one_that_backs_turns_the_other_way():
    assert rolled(CAR, 0.0, 0.5)[-1].yaw_rate[0] == 0.0
    assert rolled(CAR, -0.5, 0.3)[-1].yaw_rate[0] == pytest.approx(
        -0.5 * np.tan(0.3) / CAR.actuators.wheelbase, rel=1e-3
    )


def test_a_fast_car_corners_no_harder_than_its_tyres_hold():
    end = rolled(CAR, 3.0, 0.6, steps=300)[-1]
    speed = end.velocity_in_body[0][0]
    assert abs(speed * end.yaw_rate[0]) == pytest.approx(CAR.actuators.friction * GRAVITY, rel=1e-6)
