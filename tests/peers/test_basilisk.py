"""Our gyrostat beside Basilisk's spacecraft with reaction wheels, both driven alike.

Both hold the inertia of the whole spacecraft with its wheels locked, and speeds of wheels relative to the body: what
Basilisk calls the hub's inertia has the spin inertia of the wheels in it.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fulmar_core.dynamics.gyrostat import Flywheels, gyrostat_step
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.states.spatial import SpatialState
from fulmar_core.worlds.scenario import load_scenario
from fulmar_core.worlds.spatial_world import gravity_gradient_torque, zenith
from tests.peers.environment import run_peer

SCRIPT = Path(__file__).with_name("drive_gyrostat.py")
SATELLITES = ("cubesat_wheels", "microsat", "smallsat")
SECONDS, PERIOD_S = 60.0, 0.1
DT = {"ours": 0.05, "theirs": 0.005}  # integration steps, both of fourth order [s]
RADIUS_M = 6.771e6  # of the orbit of low_orbit


def driven(name: str, *, full: bool, orbit_rate: float = 0.0) -> dict:
    """A satellite whose body and wheels turn already, and torques that differ by wheel and time."""
    robot = load_robot(name)
    wheels, inertia = robot.actuators, robot.body.inertia_matrix.copy()
    if full:
        turned = Rotation.from_euler("xyz", [20.0, -35.0, 50.0], degrees=True).as_matrix()
        inertia = turned @ inertia @ turned.T
    times = np.arange(0.0, SECONDS, PERIOD_S)
    periods = np.array([7.0, 11.0, 17.0])
    torques = 0.9 * wheels.torque * np.sign(np.sin(2.0 * np.pi * times[:, None] / periods + [0.3, 1.1, 2.0]))
    return {
        "mass": robot.body.mass,
        "inertia": inertia.tolist(),
        "spin_inertia": wheels.spin_inertia,
        "largest_torque": wheels.torque,
        "axes": [wheel.direction.tolist() for wheel in wheels.wheels],
        "rate": [0.02, -0.03, 0.015],
        "speeds": (np.array([0.3, -0.2, 0.1]) * wheels.top_speed).tolist(),
        "torques": torques.tolist(),
        "period": PERIOD_S,
        "dt": DT["theirs"],
        "orbit_rate": orbit_rate,
        "orbit_radius": RADIUS_M,
    }


def ours(asked: dict) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rates [rad/s], wheel speeds [rad/s] and attitudes x, y, z, w after each period of commands."""
    inertia = np.array(asked["inertia"])
    tensor = tuple(np.float64(inertia[i, k]) for i, k in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)))
    wheels = Flywheels(np.array(asked["axes"]), asked["spin_inertia"])
    zero, one = np.float64(0.0), np.float64(1.0)
    rate = tuple(np.float64(part) for part in asked["rate"])
    state = SpatialState(zero, zero, zero, zero, zero, zero, one, zero, zero, zero, *rate)
    speeds = tuple(np.float64(speed) for speed in asked["speeds"])
    orbit_rate = np.float64(asked["orbit_rate"])
    found = []
    for number, torques in enumerate(asked["torques"]):
        # Held over a period, as over a control step.
        pull = gravity_gradient_torque(state, tensor, orbit_rate, zenith(orbit_rate, number * PERIOD_S))
        for _ in range(round(PERIOD_S / DT["ours"])):
            state, speeds = gyrostat_step(
                state,
                speeds,
                pull,
                None,
                lambda _speeds, torques=torques: tuple(np.float64(each) for each in torques),
                wheels,
                np.float64(asked["mass"]),
                tensor,
                DT["ours"],
            )
        found.append((state.rate, speeds, state.quat))
    rates, spins, quats = zip(*found, strict=True)
    return np.array(rates), np.array(spins), np.array(quats)


def their(asked: dict, repository: Path, folder: Path) -> dict:
    """What Basilisk finds after each period of commands."""
    (folder / "asked.json").write_text(json.dumps(asked), encoding="utf-8")
    printed = run_peer(repository, SCRIPT, folder / "asked.json", home=folder)
    return json.loads(printed.strip().splitlines()[-1])


@pytest.mark.slow
@pytest.mark.timeout(300)
@pytest.mark.parametrize(
    ("name", "full"), [*((name, False) for name in SATELLITES), ("cubesat_wheels", True)]
)
def test_our_gyrostat_turns_as_that_of_basilisk_for_a_minute(pytestconfig, tmp_path, name, full):
    asked = driven(name, full=full)
    theirs = their(asked, pytestconfig.rootpath, tmp_path)
    rates, speeds, quats = ours(asked)
    assert len(rates) == len(theirs["rates"]) == round(SECONDS / PERIOD_S)
    assert np.ptp(rates, axis=0).min() > 0.01  # they were driven
    np.testing.assert_allclose(rates, theirs["rates"], rtol=0.0, atol=1e-9)  # rad/s
    np.testing.assert_allclose(speeds, theirs["speeds"], rtol=0.0, atol=1e-9)  # rad/s
    off = Rotation.from_quat(quats).inv() * Rotation.from_mrp(theirs["mrps"])
    assert off.magnitude().max() < 1e-8  # rad


@pytest.mark.slow
@pytest.mark.timeout(300)
@pytest.mark.parametrize("name", SATELLITES)
def test_gravity_turns_our_gyrostat_as_that_of_basilisk_on_an_orbit(pytestconfig, tmp_path, name):
    asked = driven(name, full=True, orbit_rate=load_scenario("low_orbit").orbit_rate)
    theirs = their(asked, pytestconfig.rootpath, tmp_path)
    rates, speeds, quats = ours(asked)
    # Without gravity it turns otherwise by 1e-5 rad/s; Basilisk's torque turns with the body within a period.
    still, _, _ = ours({**asked, "orbit_rate": 0.0})
    assert np.abs(still - theirs["rates"]).max() > 5e-6
    np.testing.assert_allclose(rates, theirs["rates"], rtol=0.0, atol=1e-7)  # rad/s
    np.testing.assert_allclose(speeds, theirs["speeds"], rtol=0.0, atol=1e-7)  # rad/s
    off = Rotation.from_quat(quats).inv() * Rotation.from_mrp(theirs["mrps"])
    assert off.magnitude().max() < 3e-6  # rad
