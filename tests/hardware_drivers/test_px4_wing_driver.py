"""Driver of a fixed wing behind PX4: taking over in flight, set points, and giving back where commands end."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from fulmar_core.config.errors import DeviceError
from fulmar_core.safety.command_end import CommandEnd
from fulmar_core.simulation.backend import Sample
from hardware_drivers.driver_backend import EndTakingDriverBackend, backend_of
from hardware_drivers.flight_set_points import FlightSetPoints
from hardware_drivers.px4_settings import Px4Failsafe, Px4Wing
from hardware_drivers.px4_wing_driver import Px4WingDriver
from sim_nodes.emulators.px4 import LOITER, OFFBOARD, RTL, Px4Emulator
from tests.hardware_drivers.px4_bench import Ends
from tests.hardware_drivers.wing_bench import ROBOT, WingBench, episode_at, trim, until

FAILSAFE = Px4Failsafe("return", "set_by_hand", loss_s=0.4)


@pytest.fixture
def ends() -> Ends:
    return Ends()


@pytest.fixture
def bench(ends: Ends) -> Iterator[WingBench]:
    """A wing that flies in Hold."""
    device = Px4Emulator(ROBOT, (), wing=True)
    device.parameters.values |= {"COM_OF_LOSS_T": 0.4, "COM_OBL_RC_ACT": 3}
    device.connect(ends.px4)
    made = WingBench(device)
    yield made
    made.stop()


def driver_of(ends: Ends, **more: Any) -> EndTakingDriverBackend:
    settings = replace(Px4Wing("px4_wing", FAILSAFE, arm=True), **more)
    made = backend_of(ROBOT, Px4WingDriver(ROBOT, settings, ends.driver, patience_s=2.0))
    assert isinstance(made, EndTakingDriverBackend)
    return made


@pytest.fixture
def driver(bench: WingBench, ends: Ends) -> Iterator[EndTakingDriverBackend]:
    made = driver_of(ends)
    made.reset(episode_at(), seed=0)
    yield made
    made.close()


def fly(driver: EndTakingDriverBackend, seconds: float = 0.02, end: CommandEnd = CommandEnd.NONE) -> Sample:
    """Command trim at 50 Hz as the plant does, with why commands end."""
    until_s, command = time.monotonic() + seconds, trim()
    while True:
        driver.take_end(end)
        sample = driver.step(command)
        time.sleep(0.02)
        if time.monotonic() >= until_s:
            return sample


def taken(bench: WingBench, driver: EndTakingDriverBackend) -> None:
    until(lambda: fly(driver) and bench.device.nav_state == OFFBOARD)
    fly(driver, 0.1)


def test_a_wing_is_taken_over_with_the_first_command_and_not_before(bench, ends, driver):
    fly(driver, 0.2, CommandEnd.WAITING)
    assert bench.device.nav_state == LOITER
    assert not {kind for kind, _ in ends.driver.sent} & {"VehicleRatesSetpoint", "VehicleCommand"}
    taken(bench, driver)
    assert fly(driver).refusal == ""
    first = [kind for kind, _ in ends.driver.sent].index("VehicleRatesSetpoint")
    assert "VehicleCommand" in [kind for kind, _ in ends.driver.sent[:first]]
    assert bench.device.received["OffboardControlMode"].body_rate


def test_trim_asks_for_level_flight_with_its_throttle(bench, driver):
    taken(bench, driver)
    rates = bench.device.received["VehicleRatesSetpoint"]
    assert [rates.roll, rates.pitch, rates.yaw] == pytest.approx([0.0] * 3, abs=0.1)
    assert rates.thrust_body == pytest.approx([trim()[-1], 0.0, 0.0])
    fly(driver, 1.0)
    assert bench.height == pytest.approx(40.0, abs=0.5)


def test_surfaces_ask_for_the_turn_rates_of_the_robots_model():
    state, points = episode_at().start.to_rigid(), FlightSetPoints(ROBOT, 0.2)
    for number, axis, sign in ((0, 1, 1.0), (1, 0, 1.0), (2, 2, 1.0)):  # elevator, aileron, rudder
        command = trim().copy()
        command[number] += 0.05
        change = points.of(state, command).rates - points.of(state, trim()).rates
        assert np.argmax(np.abs(change)) == axis
        assert change[axis] * sign > 0.05
    assert points.of(state, np.array([0.0, 0.0, 0.0, 1.0])).thrust == 1.0


def test_attitudes_are_those_of_the_model_too(bench, ends):
    driver = driver_of(ends, set_points="attitude")
    driver.reset(episode_at(), seed=0)
    taken(bench, driver)
    received = bench.device.received
    _, x, y, _ = received["VehicleAttitudeSetpoint"].q_d
    assert np.hypot(x, y) == pytest.approx(np.sin(0.5 * 0.069), abs=0.01)  # of the trim's pitch
    assert received["OffboardControlMode"].attitude
    assert "VehicleRatesSetpoint" not in received
    driver.close()


def test_under_the_e_stop_px4_holds_at_once(bench, driver):
    taken(bench, driver)
    until(lambda: fly(driver, end=CommandEnd.STOPPED) and bench.device.nav_state == LOITER, timeout_s=0.3)
    asked = bench.device.counts["VehicleRatesSetpoint"]
    assert fly(driver, 0.2, CommandEnd.STOPPED).refusal == ""
    assert bench.device.counts["VehicleRatesSetpoint"] == asked
    fly(driver, 0.1, CommandEnd.WAITING)
    taken(bench, driver)


def test_in_silence_the_stream_stops_px4s_failsafe_acts_and_a_person_gives_back(bench, driver):
    taken(bench, driver)
    asked, streamed = (bench.device.counts[kind] for kind in ("VehicleRatesSetpoint", "OffboardControlMode"))
    until(
        lambda: fly(driver, end=CommandEnd.SILENT).refusal.startswith(
            "PX4 is in mode 5 (AUTO_RTL), not OFFBOARD"
        )
    )
    assert bench.device.nav_state == RTL
    assert bench.device.counts["VehicleRatesSetpoint"] == asked
    assert bench.device.counts["OffboardControlMode"] == streamed
    assert fly(driver, end=CommandEnd.STOPPED).refusal == ""
    fly(driver, 0.05, CommandEnd.WAITING)
    taken(bench, driver)


def test_a_short_silence_is_bridged_by_px4(bench, driver):
    taken(bench, driver)
    fly(driver, 0.2, CommandEnd.SILENT)
    assert fly(driver, 0.2).refusal == ""
    assert bench.device.nav_state == OFFBOARD


def test_a_pilot_who_takes_over_keeps_the_wing(bench, driver):
    taken(bench, driver)
    bench.device.nav_state = 2
    until(lambda: fly(driver).refusal.startswith("PX4 is in mode 2 (POSCTL)"))
    fly(driver, 0.5)
    assert bench.device.nav_state == 2


def test_a_px4_that_refuses_offboard_mode_is_a_refusal_in_words(bench, driver):
    bench.device.denied = {176}
    until(lambda: fly(driver).refusal.startswith("PX4 refuses mode OFFBOARD: denied; it is in mode 4"), 6.0)


def test_a_wing_that_is_not_armed_and_what_is_no_wing_are_not_taken_over(bench, ends):
    bench.device.armed = False
    until(lambda: any(f.get("arming_state") == 1 for k, f in list(ends.px4.sent) if k == "VehicleStatus"))
    driver = driver_of(ends)
    with pytest.raises(DeviceError, match="takes over in flight"):
        driver.reset(episode_at(), seed=0)
    bench.device.lie = lambda kind, fields: (
        fields | {"vehicle_type": 1} if kind == "VehicleStatus" else fields
    )
    bench.device.armed = True
    time.sleep(0.1)
    with pytest.raises(DeviceError, match="no fixed wing: its vehicle_type is 1"):
        driver.reset(episode_at(), seed=0)
    driver.close()


def test_at_the_end_px4_holds(bench, driver):
    taken(bench, driver)
    driver.close()
    until(lambda: bench.device.nav_state == LOITER)


@pytest.mark.parametrize(
    ("failsafe", "words"),
    [
        (Px4Failsafe("disarm", "set_by_hand"), "ends a flight"),
        (Px4Failsafe("hold", "silence"), "'confirm: silence' is for thrusters"),
    ],
)
def test_a_failsafe_that_is_none_for_a_wing_is_a_mistake_in_the_file(failsafe, words):
    with pytest.raises(ValueError, match=words):
        Px4Wing("px4_wing", failsafe)
