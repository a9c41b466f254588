"""Torques of an orbit are held over control steps, and yet right to second order."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.dynamics.batch_dynamics import Steps
from fulmar_core.dynamics.by_kind import actuation_of, dynamics_of
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.states.attitude import angle_between
from fulmar_core.states.counter_rng import Draws
from fulmar_core.states.spatial import SpatialState
from fulmar_core.worlds.parts import Solar
from fulmar_core.worlds.scenario import Scenario

ORBIT = 0.00113  # rad/s, at 400 km
PERIOD_S, TICK_S = 400.0, 1.0


def turned(name, scenario, control_s):
    """Attitude of a body that tumbles slowly, after 400 s in control steps of so long."""
    robot = load_robot(name)
    x, y, z = robot.body.inertia[:3]
    body = replace(robot.body, inertia=(x, 1.3 * y, 1.6 * z))  # a sphere would feel nothing
    robot = replace(
        robot, body=body, timing=replace(robot.timing, physics_dt=TICK_S, control_hz=1.0 / control_s)
    )
    dynamics, one = dynamics_of(robot), np.zeros(1)
    world = dynamics.draw_world(scenario, Draws(0, one, one))
    actuation = actuation_of(robot, np.array(robot.actuators.safe_command)[:, None])
    start = (0.0,) * 3 + (0.3, 0.2, 0.1, math.sqrt(0.86)) + (0.0,) * 3 + (0.002, -0.003, 0.001)
    state = SpatialState(*(np.array([value]) for value in start))
    ticks = round(control_s / TICK_S)
    for step in range(round(PERIOD_S / control_s)):
        outside = dynamics.outside(state, world, np.array([step * control_s]), control_s)
        state = dynamics.move(state, actuation, world, outside, Steps(ticks))
    return state.quat


@pytest.mark.parametrize(
    ("name", "more"),
    [
        ("spacecraft_16", {}),
        ("cubesat_wheels", {}),
        ("cubesat_wheels", {"solar": Solar(force=1e-6, arm=0.05)}),
    ],
)
def test_half_the_step_leaves_a_quarter_of_the_error(name, more):
    scenario = Scenario("orbit", sensor_noise=False, body="nominal", orbit_rate=ORBIT, **more)
    exact = turned(name, scenario, TICK_S)
    coarse, fine = (float(angle_between(turned(name, scenario, s), exact)[0]) for s in (40.0, 20.0))
    assert 0.0 < fine < 0.35 * coarse
