"""Valves and bearing at the pins: polarity, order, times, and what is left when the driver goes."""

from __future__ import annotations

from dataclasses import replace

import gpiod
import numpy as np
import pytest

from fulmar_core.config.errors import DeviceError
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.backend import AirBearing
from fulmar_core.simulation.episode import draw_episode
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario
from hardware_drivers.devices import make_device
from hardware_drivers.driver_backend import DriverBackend, backend_of
from hardware_drivers.gpio import output_lines
from hardware_drivers.hardware import Hardware, load_hardware
from hardware_drivers.settings import Bearing, GpioValves, Supply
from hardware_drivers.thruster_driver import ThrusterDriver, ValveDriver
from sim_nodes.emulators.outputs import ValveBank
from tests.hardware_drivers.bench import episode_at

ROBOT = load_robot("floating_platform")


@pytest.fixture(params=[True, False], ids=["active low", "active high"])
def rig(tmp_path, request):
    lab = load_hardware("zero_g_lab").driver
    bank = ValveBank(tmp_path / "gpio", ROBOT, order=lab.order, active_low=request.param)
    settings = replace(
        lab,
        port=bank.address,
        active_low=request.param,
        min_on_s=0.0,
        bearing=replace(lab.bearing, linger_s=0.0, idle_off_s=0.0),
    )
    yield bank, settings
    bank.close()


def started(settings) -> DriverBackend:
    driver = backend_of(ROBOT, ThrusterDriver(ROBOT, settings, patience_s=0.0))
    driver.reset(episode_at(ROBOT, 0.0, 0.0, 0.0), seed=0)
    return driver


@pytest.mark.parametrize("thruster", range(8))
def test_each_thruster_opens_its_own_valve_and_no_other(rig, thruster):
    bank, settings = rig
    command = np.eye(8)[thruster]
    sample = started(settings).step(command)
    assert bank.command(0.0).tolist() == command.tolist()
    assert sample.applied.tolist() == command.tolist()
    assert sample.odometry is None


def test_sixteen_valves_without_a_bearing_open_and_close_each_by_its_own_line(tmp_path):
    craft, order = load_robot("spacecraft_16"), tuple(np.roll(range(16), 5).tolist())
    bank = ValveBank(tmp_path / "gpio", craft, order=order, active_low=True, bearing=False)
    lines = tuple(map(str, range(16)))
    settings = GpioValves("gpio_valves", port=bank.address, lines=lines, order=order)
    hardware = Hardware("sixteen valves", craft.name, settings)
    assert not hardware.has_bearing
    driver = make_device(craft, hardware, port="", patience_s=0.0)
    try:
        assert not isinstance(driver, AirBearing)
        start = draw_episode(craft, load_task("go_to_pose_3d"), load_scenario("ideal"), seed=1, number=0)
        driver.reset(start, seed=0)
        assert bank.levels().tolist() == [1] * 16
        for thruster in range(16):
            command = np.eye(16)[thruster]
            assert driver.step(command).applied.tolist() == command.tolist()
            assert bank.command(0.0).tolist() == command.tolist()
            assert bank.levels()[order.index(thruster)] == 0
    finally:
        driver.close()
    assert bank.levels().tolist() == [1] * 16
    bank.close()


def test_taking_the_lines_opens_nothing(rig):
    bank, settings = rig
    ThrusterDriver(ROBOT, settings, patience_s=0.0)
    assert set(bank.levels().tolist()) == {int(settings.active_low)}


def test_without_air_no_valve_opens_and_the_driver_says_so(rig):
    bank, settings = rig
    driver = started(settings)
    driver.step(np.ones(8))
    assert driver.set_bearing(False) == ""
    assert not driver.step(np.ones(8)).applied.any()
    assert set(bank.levels().tolist()) == {int(settings.active_low)}
    assert "bearing is off" in driver.health()["warning"]


def test_the_safe_state_closes_valves_and_keeps_the_platform_afloat(rig):
    bank, settings = rig
    driver = started(settings)
    driver.step(np.ones(8))
    driver.make_safe()
    assert not bank.command(0.0).any()
    assert driver.bearing_on
    assert bank.levels()[-1] == int(not settings.active_low)


def test_closing_closes_everything_once_and_for_all(rig):
    bank, settings = rig
    driver = started(settings)
    driver.step(np.ones(8))
    driver.close()
    driver.close()
    assert set(bank.levels().tolist()) == {int(settings.active_low)}
    assert driver.set_bearing(True)  # refused, with a reason


def test_valves_are_closed_before_their_lines_are_released(tmp_path):
    craft, order = load_robot("spacecraft_16"), tuple(range(16))
    bank = ValveBank(tmp_path / "gpio", craft, order=order, active_low=True, bearing=False)
    settings = GpioValves("gpio_valves", port=bank.address, lines=tuple(map(str, order)), order=order)
    driver = ValveDriver(craft, settings, patience_s=0.0)
    driver.write(np.ones(16))
    assert not bank.levels().any()
    driver.close()  # by itself, whatever was written before
    assert bank.levels().all()
    bank.close()


def test_a_bearing_that_nobody_needs_is_switched_off(rig, monkeypatch):
    _bank, settings = rig
    now = [0]
    monkeypatch.setattr("hardware_drivers.thruster_driver.time.monotonic_ns", lambda: now[0])
    driver = started(replace(settings, bearing=replace(settings.bearing, idle_off_s=60.0)))
    driver.step(np.ones(8))
    for second in (59, 61):
        now[0] = second * 10**9
        driver.step(np.zeros(8))
    assert not driver.bearing_on


@pytest.fixture
def fed(tmp_path, monkeypatch):
    """A platform whose supply has a valve of its own, with its pins and a clock [ns]."""
    lab, now = load_hardware("zero_g_lab").driver, [10**12]
    monkeypatch.setattr("hardware_drivers.thruster_driver.time.monotonic_ns", lambda: now[0])
    bank = ValveBank(tmp_path / "gpio", ROBOT, order=lab.order, active_low=True, supply=True)
    bearing = replace(lab.bearing, linger_s=0.0, idle_off_s=0.0)
    settings = replace(lab, port=bank.address, min_on_s=0.0, bearing=bearing, supply=Supply("PY.00"))
    yield bank, started(settings), now
    bank.close()


def shut(bank):
    return bool(bank.levels()[-1])


def test_the_supply_is_open_while_valves_are_and_shut_after_a_rest(fed):
    bank, driver, now = fed
    assert shut(bank)
    driver.step(np.eye(8)[3])
    assert not shut(bank)
    assert bank.command(0.0).tolist() == np.eye(8)[3].tolist()
    for passed_s, closed in ((0.0, False), (0.9, False), (1.1, True)):
        driver.step(np.zeros(8))
        now[0] += round(1e9 * passed_s)
        driver.step(np.zeros(8))
        assert shut(bank) == closed
        now[0] -= round(1e9 * passed_s)
    driver.step(np.ones(8))
    assert not shut(bank)


@pytest.mark.parametrize("end", ["close", "no air"])
def test_the_supply_is_shut_with_the_driver_and_with_the_air(fed, end):
    bank, driver, _now = fed
    driver.step(np.ones(8))
    if end == "close":
        driver.close()
    else:
        driver.set_bearing(False)
    assert shut(bank)


def test_a_driver_that_dies_leaves_its_valves_as_they_were(rig):
    """That is copper, not code: no process can close a valve after its own death."""
    bank, settings = rig
    driver = started(settings)
    driver.step(np.eye(8)[3])
    del driver
    assert bank.command(1e9).tolist() == np.eye(8)[3].tolist()


def test_libgpiod_is_asked_for_outputs_that_begin_inactive(monkeypatch):
    asked = {}

    def request_lines(path, consumer, config):
        asked.update(path=path, consumer=consumer, config=config)

    monkeypatch.setattr(gpiod, "request_lines", request_lines)
    output_lines("/dev/gpiochip0", ["PZ.06", "17"], active_low=True)
    ((lines, settings),) = asked["config"].items()
    assert (asked["path"], lines) == ("/dev/gpiochip0", ("PZ.06", 17))
    assert settings.direction is gpiod.line.Direction.OUTPUT
    assert settings.output_value is gpiod.line.Value.INACTIVE
    assert settings.active_low is True


def test_a_chip_that_is_not_there_is_named_with_what_to_do():
    with pytest.raises(DeviceError, match=r"/dev/gpiochip99: lines A, B cannot be taken .*gpioinfo"):
        output_lines("/dev/gpiochip99", ["A", "B"], active_low=True)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"order": (0, 1, 2, 3, 4, 5, 6, 6)}, "must hold each of 0 to 7 once"),
        ({"lines": ("A",) * 8}, "a line of their own"),
        ({"supply": Supply("I")}, "a line of their own"),
        ({"min_on_s": 0.5}, "min_on_s must be from 0 to 0.2 s"),
    ],
)
def test_wiring_that_cannot_be_is_refused(change, says):
    fields = {
        "kind": "gpio_valves",
        "port": "x",
        "lines": tuple("ABCDEFGH"),
        "order": tuple(range(8)),
        "bearing": Bearing("I"),
    }
    with pytest.raises(ValueError, match=says):
        GpioValves(**{**fields, **change})


def test_a_line_that_is_not_at_the_level_that_was_set_is_a_refusal_by_its_name(rig):
    bank, settings = rig
    driver = started(settings)
    thruster = settings.order[3]  # of the fourth line
    for command in (np.eye(8)[thruster], np.zeros(8), np.zeros(8)):
        assert driver.step(command).refusal == ""
    driver._driver._lines._levels[3] ^= 1  # as by another program
    refusal = driver.step(np.zeros(8)).refusal
    assert refusal.startswith(f"{bank.address}: line {settings.lines[3]} is not at the level that was set")
    assert driver.step(np.zeros(8)).refusal == ""
    driver.close()


def test_a_chip_that_reads_nothing_but_low_is_a_warning_and_no_refusal(rig, monkeypatch):
    _, settings = rig
    driver = started(settings)
    low = gpiod.line.Value.ACTIVE if settings.active_low else gpiod.line.Value.INACTIVE
    monkeypatch.setattr(driver._driver._lines, "get_values", lambda lines: [low] * len(lines))
    for command in (np.eye(8)[2], np.zeros(8), np.ones(8), np.zeros(8)):
        assert driver.step(command).refusal == ""
    driver.step(np.eye(8)[2])
    driver.step(np.eye(8)[2])
    assert "is not read as it was set" in driver.health()["warning"]
    driver.close()


def test_a_chip_that_does_not_read_its_outputs_refuses_nothing(rig, monkeypatch):
    _, settings = rig
    driver = started(settings)

    def unreadable(_lines):
        raise OSError("not supported")

    monkeypatch.setattr(driver._driver._lines, "get_values", unreadable)
    assert driver.step(np.eye(8)[2]).refusal == ""
    assert driver.step(np.zeros(8)).refusal == ""
    driver.close()
