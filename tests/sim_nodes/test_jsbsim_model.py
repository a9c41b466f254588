"""airship_v7 written for JSBSim: coefficients at random points, and flights under the same inputs."""

from __future__ import annotations

from pathlib import Path

import jsbsim
import numpy as np
import pytest

from fulmar_core.dynamics.batch_dynamics import Steps
from fulmar_core.dynamics.by_kind import actuation_of
from fulmar_core.dynamics.flight_dynamics import FlightDynamics
from fulmar_core.dynamics.flight_trim import find_trim, still_air
from fulmar_core.robots.airframe.airframe import flow_past
from fulmar_core.robots.robot_file import load_robot
from sim_nodes.jsbsim_model import FOOT, RADIUS_M, write_aircraft

NAMES = ("CL", "CD", "CY", "Cl", "Cm", "Cn")


@pytest.fixture
def written(tmp_path) -> Path:
    for name in ("airship_v7", "navion", "a0s"):
        write_aircraft(load_robot(name), tmp_path)
    return tmp_path


def model_of(name: str, folder: Path):
    model = jsbsim.FGFDMExec(None)
    model.set_debug_level(0)
    model.set_aircraft_path(str(folder))
    assert model.load_planet(str(folder / "still_planet.xml"), False)
    assert model.load_model(name, True)
    return model


def begin(model, *, speed, height, alpha, beta=0.0, rate=(0.0, 0.0, 0.0)):
    model["ic/terrain-elevation-ft"] = 0.0
    model["ic/h-sl-ft"] = height / FOOT
    model["ic/psi-true-deg"] = 90.0
    model["ic/theta-rad"] = alpha
    for axis, value in zip("uvw", airspeed(speed, alpha, beta), strict=True):
        model[f"ic/{axis}-fps"] = value / FOOT
    for axis, value in zip("pqr", rate, strict=True):
        model[f"ic/{axis}-rad_sec"] = value
    assert model.run_ic()


def airspeed(speed, alpha, beta):
    ca, sa, cb, sb = np.cos(alpha), np.sin(alpha), np.cos(beta), np.sin(beta)
    return speed * ca * cb, speed * sb, speed * sa * cb


@pytest.mark.parametrize("name", ["airship_v7", "a0s"])
def test_coefficients_at_twenty_random_points_are_ours(written, name):
    robot, model = load_robot(name), model_of(name, written)
    frame, rng = robot.airframe, np.random.default_rng(4)
    for _ in range(20):
        alpha, beta = rng.uniform(-0.12, 0.16), rng.uniform(-0.15, 0.15)
        speed, height = frame.speed * rng.uniform(0.7, 1.3), frame.span * rng.uniform(0.25, 4.0)
        rate, moved = rng.uniform(-0.5, 0.5, 3), rng.uniform(-0.2, 0.2, 3)
        for surface, angle in zip(("elevator", "aileron", "rudder"), moved, strict=True):
            model[f"fulmar/{surface}"] = angle
        begin(model, speed=speed, height=height, alpha=alpha, beta=beta, rate=rate)
        surfaces = dict(zip(("elevator", "aileron", "rudder"), map(np.asarray, moved), strict=True))
        velocity = tuple(map(np.asarray, airspeed(speed, alpha, beta)))
        air = flow_past(velocity, tuple(map(np.asarray, rate)), surfaces, frame)
        ours = frame.coefficients(air, np.asarray(model["position/h-agl-ft"] * FOOT))
        theirs = [model[f"fulmar/{each}"] for each in ("CL", "CD")]
        theirs += [model[f"fulmar/{each}-free"] for each in NAMES[2:]]
        np.testing.assert_allclose([float(ours[each]) for each in NAMES], theirs, rtol=0, atol=1e-9)


def flown_by_jsbsim(model, robot, trim, commands, dt):
    """Heights above the start [m] and turn rates [rad/s], x ahead, y right, z down, after two seconds."""
    model.set_dt(dt)
    for actuator, value in zip(robot.actuators.names, commands, strict=True):
        model[f"fulmar/{actuator}"] = value
    begin(model, speed=trim.speed, height=trim.height, alpha=trim.alpha)
    for _ in range(round(2.0 / dt)):
        assert model.run()
    ahead = (model["position/long-gc-rad"]) * RADIUS_M
    left = model["position/lat-gc-rad"] * RADIUS_M
    place = np.array([ahead, left, model["position/h-sl-meters"]])
    return place, np.array([model[f"velocities/{axis}-rad_sec"] for axis in "pqr"])


def flown_by_us(robot, trim, commands, dt):
    dynamics, world = FlightDynamics(robot, turbulent=False), still_air(robot, 1)
    state = trim.state.mapped(lambda part: np.asarray(part, dtype=float).reshape(1))
    actuation = actuation_of(robot, commands[:, None])
    actuation.begin(commands[:, None], world, None)
    for _ in range(200):
        state = dynamics.move(state, actuation, world, (np.zeros(1),) * 3, Steps(1))
    place = np.array([state.x[0], state.y[0], state.z[0]])
    return place, np.array([state.wx[0], -state.wy[0], -state.wz[0]])


@pytest.mark.parametrize("name", ["airship_v7", "navion"])
def test_a_flight_under_the_same_inputs_is_ours_the_nearer_the_shorter_the_step(written, name):
    robot = load_robot(name)
    trim = find_trim(robot, robot.airframe.speed, 2.0 * robot.airframe.span)
    commands = trim.command.copy()
    commands[:3] += [-0.01, 0.01, 0.005]
    place, rate = flown_by_us(robot, trim, commands, 0.01)
    off = []
    for dt in (0.004, 0.001, 0.00025):
        theirs, turning = flown_by_jsbsim(model_of(name, written), robot, trim, commands, dt)
        off.append((np.abs(theirs - place).max(), np.abs(turning - rate).max()))
    assert np.abs(rate).max() > 0.01  # it was steered
    assert off[2][0] < 0.01, off
    assert off[2][1] < 1e-3, off
    assert off[2][1] <= off[0][1], off
