"""A tank empties by what its nozzles blow out, thrust follows its pressure, and a warning comes in time."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from fulmar_core.estimators.actuator_health.supply_check import SupplyCheck
from fulmar_core.robots.actuators.tank import Tank
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.episode import draw_episode
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.tasks import load_task
from fulmar_core.wires.reading import Reading
from fulmar_core.worlds.parts import Actuation, Supply
from fulmar_core.worlds.scenario import load_scenario
from sim_nodes.mock_backend import MockBackend
from sim_nodes.mujoco_backend import MujocoBackend

PLATFORM, SPACECRAFT = load_robot("floating_platform"), load_robot("spacecraft_16")
TANK = PLATFORM.actuators.tank
BOTH = pytest.mark.parametrize(
    ("robot", "task"),
    [(PLATFORM, "go_to_pose"), (SPACECRAFT, "go_to_pose_3d")],
    ids=lambda each: getattr(each, "name", each),
)
BACKENDS = pytest.mark.parametrize("backend", [MockBackend, MujocoBackend])


def low(share):
    scenario = load_scenario("ideal")
    return replace(scenario, actuation=Actuation(supply=Supply(tank=share)))


def opened(backend, robot, task, scenario, *, seconds=20.0):
    """Pressures [Pa] and forward speeds, step by step, with one valve open."""
    task = load_task(task)
    simulator = backend(robot)
    sample = simulator.reset(draw_episode(robot, task, scenario, seed=1, number=0), seed=1)
    first = np.array(robot.actuators.safe_command, dtype=float)
    first[0] = 1.0
    pressures, speeds = [], []
    for _ in range(round(seconds * robot.timing.control_hz)):
        sample = simulator.step(first, robot.timing.substeps(robot.timing.control_hz))
        if "supply" in sample.readings:
            pressures.append(sample.readings["supply"].value)
        speeds.append(float(np.linalg.norm(sample.truth.velocity_in_world)))
    return np.array(pressures), np.array(speeds)


def test_the_pressure_falls_as_that_of_an_ideal_gas():
    """By mass and density: one newton for ten seconds, and what leaks."""
    gone = 10.0 * (1.0 / (TANK.specific_impulse * 9.80665) + TANK.leak)  # kg
    begin, end = (
        p * TANK.volume / (TANK.gas_constant * TANK.temperature)
        for p in (3.0e7, 3.0e7 - 10.0 * TANK.fall(1.0))
    )
    assert begin - end == pytest.approx(gone, rel=1e-12)


@BOTH
@BACKENDS
def test_the_tank_of_a_simulated_robot_empties_by_what_is_blown_out(backend, robot, task):
    pressures, _ = opened(backend, robot, task, low(1.0))
    fall = robot.actuators.tank.fall(robot.actuators.thrust)
    steps = np.diff(pressures) * robot.timing.control_hz
    assert np.abs(steps + fall).max() < 5.0 * robot.sensors.specs["supply"].std * robot.timing.control_hz
    assert pressures[-1] - pressures[0] == pytest.approx(
        -fall * (len(pressures) - 1) / robot.timing.control_hz, abs=5.0 * robot.sensors.specs["supply"].std
    )


@BOTH
@BACKENDS
def test_thrust_follows_the_pressure_below_that_of_the_regulator(backend, robot, task):
    """What is pushed by a nearly empty tank gets no faster in the end."""
    _, full = opened(backend, robot, task, low(1.0))
    pressures, empty = opened(backend, robot, task, low(0.03))
    assert np.isclose(full[:3], empty[:3], rtol=1e-6).all()
    assert pressures[-1] < robot.actuators.tank.regulated
    assert empty[-1] - empty[-6] < 0.5 * (full[-1] - full[-6])


@BOTH
def test_a_batch_has_the_tank_where_a_scenario_says_how_full_it_is(robot, task):
    batches = [BatchSimulation(robot, load_task(task), low(share), worlds=2, seed=1) for share in (1.0, 0.03)]
    first = np.zeros((2, len(robot.actuators.names)))
    first[:, 0] = 1.0
    for _ in range(round(20.0 * robot.timing.control_hz)):
        for batch in batches:
            batch.move(first)
    full, empty = (batch._actuation for batch in batches)
    assert not hasattr(full, "pressure")
    assert (empty.pressure < robot.actuators.tank.regulated).all()
    assert (empty.gain < 1.0).all()
    batches[1].reset([0])
    np.testing.assert_allclose(empty.pressure[0], 0.03 * robot.actuators.tank.pressure)
    assert empty.pressure[1] < empty.pressure[0]


def test_a_low_pressure_is_said_before_thrust_falls():
    assert TANK.warning(3.0e7, 1.0) == ""
    soon = TANK.warning(TANK.regulated + 30.0 * TANK.fall(1.0), 1.0)
    assert soon.endswith("lasts for 30 s of full thrust. Refill soon")
    assert TANK.share(np.array(TANK.regulated + 30.0 * TANK.fall(1.0))) == 1.0
    late = TANK.warning(0.25 * TANK.regulated, 1.0)
    assert (
        late
        == "supply pressure 2 bar is below the 8 bar of the regulator: thrust has fallen to 25 %. Stop and refill"
    )


def test_a_gauge_that_falls_silent_or_lies_is_said():
    check = SupplyCheck(PLATFORM)
    check.see(1.0, {"supply": Reading(2.0e7)})
    assert (check.warning, check.pressure) == ("", 2.0e7)
    for _ in range(6):
        check.see(1.0, {})
    assert check.warning == "no supply pressure for 6 s. Is the gauge connected?"
    check.see(1.0, {"supply": Reading(9.0e9)})
    assert "the gauge of the supply reports 9e+09, and can report 4.5e+07 at most" in check.warning
    check.see(1.0, {"supply": Reading(1.0e6)})
    assert check.warning.startswith("supply pressure 10 bar lasts for ")
    check.reset()
    assert (check.warning, check.pressure) == ("", None)


def test_a_device_without_a_gauge_is_not_one_whose_gauge_fell_silent():
    check = SupplyCheck(PLATFORM)
    for _ in range(60):
        check.see(1.0, {})
    assert check.warning == ""
    check.see(1.0, {"supply": Reading(float("nan"))})
    assert "the gauge of the supply reports a value that is not finite" in check.warning


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"pressure": 1e5}, "above 'tank.regulated'"),
        ({"volume": 0.0}, "must be greater than 0"),
        ({"leak": -1.0}, "not negative"),
    ],
)
def test_a_tank_that_cannot_be_is_refused(changed, said):
    with pytest.raises(ValueError, match=said):
        Tank(**{"volume": 1e-3, "pressure": 3e7, "regulated": 8e5, "specific_impulse": 50.0} | changed)


def test_a_pressure_is_checked_once_and_its_warning_stays_until_the_next():
    asked: list[float] = []

    def warning(pressure):
        asked.append(pressure)
        return f"at {pressure:g} Pa"

    actuators = SimpleNamespace(tank=TANK, supply_warning=warning)
    check = SupplyCheck(PLATFORM)
    check._robot = SimpleNamespace(sensors=PLATFORM.sensors, actuators=actuators)
    warnings = []
    for readings in ({"supply": Reading(2e5)}, {}, {}, {"supply": Reading(1e5)}, {}):
        check.see(0.1, readings)
        warnings.append(check.warning)
    assert warnings == [*["at 200000 Pa"] * 3, *["at 100000 Pa"] * 2]
    assert asked == [2e5, 1e5]


def test_the_first_readings_of_a_gauge_empty_no_tank():
    check = SupplyCheck(PLATFORM)
    for pressure in (0.0, *[2e7] * 60):
        check.see(0.2, {"supply": Reading(pressure)})
        assert check.empty is None
    for _ in range(200):
        check.see(0.2, {"supply": Reading(0.0)})
    assert check.empty is not None
