"""Driver of a fixed wing with ArduPlane: its failsafe at connect, set points in GUIDED, and where commands end."""

from __future__ import annotations

import struct
import time
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from fulmar_core.config.errors import DeviceError
from fulmar_core.safety.command_end import CommandEnd
from fulmar_core.simulation.backend import Sample
from hardware_drivers.driver_backend import EndTakingDriverBackend, backend_of
from hardware_drivers.flight_set_points import SetPoint
from hardware_drivers.plane_autopilot import attitude_target
from hardware_drivers.plane_driver import PlaneDriver
from hardware_drivers.plane_settings import MavlinkPlane
from sim_nodes.emulators.arduplane import GUIDED, LOITER, RTL, ArduPlaneEmulator
from tests.hardware_drivers.boat_bench import free_udp_port
from tests.hardware_drivers.wing_bench import ROBOT, WingBench, episode_at, trim, until


@pytest.fixture
def bench() -> Iterator[WingBench]:
    """An ArduPlane that flies in LOITER, its failsafes as they come from the factory."""
    made = WingBench(ArduPlaneEmulator(ROBOT, free_udp_port()))
    yield made
    made.stop()


def driver_of(bench: WingBench, **more: Any) -> EndTakingDriverBackend:
    settings = replace(MavlinkPlane("mavlink_plane", bench.device.address, loss_s=1.2, arm=True), **more)
    made = backend_of(ROBOT, PlaneDriver(ROBOT, settings, patience_s=5.0))
    assert isinstance(made, EndTakingDriverBackend)
    return made


@pytest.fixture
def driver(bench: WingBench) -> Iterator[EndTakingDriverBackend]:
    made = driver_of(bench)
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
    until(lambda: fly(driver) and bench.device.mode == GUIDED and bench.device.target is not None)


def test_the_failsafe_is_set_and_checked_at_connect(bench):
    bench.device.parameters.values |= {"THR_FAILSAFE": 0, "SYSID_MYGCS": 1}
    driver = driver_of(bench)
    assert bench.device.parameters.values == {
        "SYSID_MYGCS": 255, "FS_GCS_ENABL": 1, "FS_LONG_ACTN": 1, "FS_LONG_TIMEOUT": pytest.approx(1.2),
        "THR_FAILSAFE": 1,
    }  # fmt: skip
    driver.close()


def test_a_failsafe_that_protects_already_stays_as_it_is(bench):
    values = {"FS_GCS_ENABL": 2, "FS_LONG_ACTN": 1, "FS_LONG_TIMEOUT": 1.0, "THR_FAILSAFE": 0}
    bench.device.parameters.values |= values
    driver_of(bench, rc_failsafe=False).close()
    assert values.items() <= bench.device.parameters.values.items()
    assert "PARAM_SET" not in bench.device.received


def test_a_failsafe_that_cannot_be_set_is_refused_with_what_to_set(bench):
    bench.device.parameters.fixed = {"FS_GCS_ENABL"}
    words = r"its parameter FS_GCS_ENABL stays 0: set it to 1 \(the failsafe of heartbeats\)\. Nothing is taken over"
    with pytest.raises(DeviceError, match=words):
        driver_of(bench)


def test_a_failsafe_that_gets_no_answer_is_refused(bench, monkeypatch):
    monkeypatch.setattr("hardware_drivers.plane_driver.ANSWERS_S", 0.3)
    bench.device.parameters.unknown = {"FS_LONG_ACTN"}
    with pytest.raises(DeviceError, match="says nothing of its parameter FS_LONG_ACTN: set it to 1"):
        driver_of(bench)


def test_a_plane_of_another_kind_is_neither_set_nor_taken_over():
    device = ArduPlaneEmulator(ROBOT, free_udp_port())
    device.kind = mavlink.MAV_TYPE_QUADROTOR  # before its first heartbeat
    bench = WingBench(device)
    try:
        with pytest.raises(DeviceError, match=r"no ArduPlane \(MAV_AUTOPILOT 3, MAV_TYPE 2\)"):
            driver_of(bench)
    finally:
        bench.stop()
    assert "PARAM_SET" not in device.received


def test_a_plane_on_the_ground_is_not_taken_over():
    device = ArduPlaneEmulator(ROBOT, free_udp_port())
    device.armed = False  # before its first heartbeat
    bench = WingBench(device)
    try:
        driver = driver_of(bench)
        with pytest.raises(
            DeviceError, match=r"not armed, in mode 12 .LOITER., and this driver takes over in flight"
        ):
            driver.reset(episode_at(), seed=0)
        driver.close()
    finally:
        bench.stop()


def test_without_arm_the_driver_measures_only(bench):
    driver = driver_of(bench, arm=False)
    driver.reset(episode_at(), seed=0)
    fly(driver, 0.3)
    assert bench.device.mode == LOITER
    assert not {"PARAM_SET", "SET_ATTITUDE_TARGET"} & set(bench.device.received)
    assert driver.health()["warning"].startswith("not armed")
    driver.close()


def test_the_first_command_takes_over_in_guided_and_trim_flies_level(bench, driver):
    fly(driver, 0.2, CommandEnd.WAITING)
    assert bench.device.mode == LOITER
    taken(bench, driver)
    assert fly(driver, 1.0).refusal == ""
    assert bench.height == pytest.approx(40.0, abs=0.7)


def test_odometry_airspeed_and_height_come_in(bench, driver):
    taken(bench, driver)
    sample, truth = fly(driver, 0.2), bench.sample.truth
    assert sample.odometry.velocity_in_world == pytest.approx(truth.velocity_in_world, abs=0.3)
    assert float(sample.odometry.yaw) == pytest.approx(float(truth.yaw), abs=0.05)
    air = dict(
        zip(*(getattr(sample.readings["air_data"].value, name) for name in ("names", "values")), strict=True)
    )
    assert air["airspeed"] == pytest.approx(np.linalg.norm(truth.velocity_in_world), abs=0.1)
    assert air["height"] == pytest.approx(truth.position_in_world[2], abs=0.1)
    assert air["alpha"] == pytest.approx(0.069, abs=0.02)
    assert driver.health()["airspeed_m_s"]


def test_heights_are_those_above_the_autopilots_origin_wherever_the_craft_is_taken_over(bench, driver):
    """A craft that is taken over in 40 m, and asked to fly in 1 m, has to descend."""
    sample = fly(driver, 0.2)
    height = sample.odometry.position_in_world[2]
    assert height == pytest.approx(bench.sample.truth.position_in_world[2], abs=0.1)
    air = sample.readings["air_data"].value
    assert height == pytest.approx(dict(zip(air.names, air.values, strict=True))["height"], abs=0.1)


def test_under_the_e_stop_it_loiters_at_once(bench, driver):
    taken(bench, driver)
    until(lambda: fly(driver, end=CommandEnd.STOPPED) and bench.device.mode == LOITER, timeout_s=0.6)
    asked = bench.device.received["SET_ATTITUDE_TARGET"]
    assert fly(driver, 0.3, CommandEnd.STOPPED).refusal == ""
    assert bench.device.received["SET_ATTITUDE_TARGET"] == asked


def test_in_silence_set_points_and_heartbeats_stop_and_its_failsafe_flies_home(bench, driver):
    taken(bench, driver)
    fly(driver, 0.1, CommandEnd.SILENT)
    asked, beaten = (bench.device.received[kind] for kind in ("SET_ATTITUDE_TARGET", "HEARTBEAT"))
    until(
        lambda: fly(driver, end=CommandEnd.SILENT).refusal.startswith(
            "the autopilot is in mode 11 (RTL), not GUIDED"
        )
    )
    assert bench.device.mode == RTL
    assert bench.device.failsafe
    assert (bench.device.received["SET_ATTITUDE_TARGET"], bench.device.received["HEARTBEAT"]) == (
        asked,
        beaten,
    )


def test_a_dead_driver_leaves_the_plane_to_its_failsafe(bench, driver):
    taken(bench, driver)
    driver._driver._session.over.set()  # no heartbeat any more, and no farewell
    until(lambda: bench.device.mode == RTL, timeout_s=3.0)


def test_a_pilot_who_changes_the_mode_keeps_the_plane(bench, driver):
    taken(bench, driver)
    bench.device.mode = 5
    until(lambda: fly(driver).refusal.startswith("the autopilot is in mode 5 (FBWA), not GUIDED"))
    fly(driver, 0.5)
    assert bench.device.mode == 5


def test_a_mode_that_is_denied_is_a_refusal_with_its_words(bench, driver):
    bench.device.denied = {mavlink.MAV_CMD_DO_SET_MODE: "GUIDED: no position"}
    until(lambda: "refuses mode GUIDED: MAV_CMD_DO_SET_MODE: denied" in fly(driver).refusal, 6.0)
    assert "no position" in driver.health()["autopilot_says"]


@pytest.mark.parametrize(("spoil", "words"), [("mute", "no report for"), ("frozen", "it stands still")])
def test_a_plane_that_falls_silent_or_whose_position_stands_still_is_an_error(bench, driver, spoil, words):
    taken(bench, driver)
    setattr(bench.device, spoil, True)
    with pytest.raises(DeviceError, match=words):
        fly(driver, 2.0)


def test_at_the_end_it_loiters(bench, driver):
    taken(bench, driver)
    driver.close()
    until(lambda: bench.device.mode == LOITER)


def test_the_bytes_of_an_attitude_are_those_of_the_standard():
    """Level to the north with 30 % of thrust: by hand from the fields of SET_ATTITUDE_TARGET (82), seed 49."""
    north = SetPoint(np.array([0.0, 0.0, np.sqrt(0.5), np.sqrt(0.5)]), np.zeros(3), 0.3)
    encoder = mavlink.MAVLink(None, srcSystem=255, srcComponent=190)
    payload = struct.pack("<I4f3ffBBB", 1234, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.3, 1, 1, 0xBC)
    head = bytes([0xFD, len(payload), 0, 0, 0, 255, 190, 82, 0, 0])
    packed = bytes(attitude_target(north, 1234, (1, 1)).pack(encoder))
    assert packed[: len(head)] == head
    assert struct.unpack("<I4f3ffBBB", packed[10:-2]) == pytest.approx(
        struct.unpack("<I4f3ffBBB", payload), abs=1e-7
    )
    assert packed[-2:] == crc(packed[1:-2], 49)


def test_the_bytes_of_a_parameter_are_those_of_the_standard():
    encoder = mavlink.MAVLink(None, srcSystem=255, srcComponent=190)
    packed = bytes(mavlink.MAVLink_param_set_message(1, 1, b"FS_GCS_ENABL", 1.0, 6).pack(encoder))
    payload = struct.pack("<fBB16sB", 1.0, 1, 1, b"FS_GCS_ENABL", 6)
    head = bytes([len(payload), 0, 0, 0, 255, 190, 23, 0, 0])
    assert packed == b"\xfd" + head + payload + crc(head + payload, 168)


def crc(data: bytes, seed: int) -> bytes:
    """X.25 checksum with the seed of a message."""
    value = 0xFFFF
    for byte in (*data, seed):
        part = byte ^ (value & 0xFF)
        part = (part ^ (part << 4)) & 0xFF
        value = (value >> 8) ^ (part << 8) ^ (part << 3) ^ (part >> 4)
    return struct.pack("<H", value)


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({"loss_s": 0.5}, "from 1 to 10 s"),
        ({"lead_s": 0.0}, "lead_s"),
        ({"silent_s": 9.0}, "silent_s"),
        ({"port": "udp:1"}, "port"),
    ],
)
def test_settings_beyond_what_arduplane_takes_are_mistakes(more, words):
    with pytest.raises(ValueError, match=words):
        MavlinkPlane(**{"kind": "mavlink_plane", "port": "udpin:127.0.0.1:14550", **more})
