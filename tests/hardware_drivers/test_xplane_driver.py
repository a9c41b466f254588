"""The driver of X-Plane against an emulated one at a UDP port: flight, pauses, and mistakes in its file."""

from __future__ import annotations

import struct
import time

import numpy as np
import pytest

from fulmar_core.config.errors import ConfigError, DeviceError
from fulmar_core.states.rotation import rotate
from hardware_drivers.driver_backend import DriverBackend, backend_of
from hardware_drivers.hardware import load_hardware
from hardware_drivers.xplane_driver import XPlaneDriver
from tests.hardware_drivers.xplane_bench import (
    ROBOT,
    START,
    Peer,
    XPlaneBench,
    begin,
    driver_at,
    running_bench,
    settings_of,
    trim,
    until,
)

bench = pytest.fixture(name="bench")(running_bench)
driver = pytest.fixture(name="driver")(driver_at)


def fly(driver: DriverBackend, seconds: float, command: np.ndarray):
    """Fly with a command a hundred times a second; returns the last sample."""
    end = time.monotonic() + seconds
    while True:
        sample = driver.step(command)
        if time.monotonic() > end:
            return sample
        time.sleep(0.01)


def test_x_plane_stands_still_until_the_flight_begins_and_after_its_end(bench):
    """It runs when the driver comes, as X-Plane does."""
    bench.device.paused = False
    driver = backend_of(ROBOT, XPlaneDriver(ROBOT, settings_of(bench.device.address), patience_s=5.0))
    until(lambda: bench.device.paused)
    place = bench.sample.truth.position_in_world
    time.sleep(0.1)
    assert (bench.sample.truth.position_in_world == place).all()
    begin(driver)
    until(lambda: not bench.device.paused)
    until(lambda: driver.step(trim()) and np.linalg.norm(bench.sample.truth.position_in_world - place) > 1.0)
    driver.close()
    until(lambda: bench.device.paused)
    assert bench.command == pytest.approx(ROBOT.actuators.safe_command)


def test_where_commands_end_x_plane_stands_still_before_the_safe_command_reaches_it(bench, driver):
    """The driver is not closed yet: other nodes end first."""
    begin(driver)
    until(lambda: driver.step(trim()) and bench.command.any())
    arrived: list[bytes] = []
    bench.device.drop = lambda datagram: arrived.append(datagram)
    driver.make_safe()
    until(lambda: np.allclose(bench.command, ROBOT.actuators.safe_command))
    assert bench.device.paused
    heads = [found[:4] for found in arrived]
    first = heads.index(b"SIMU")
    before = [struct.unpack_from("<3f", found, 5) for found in arrived[:first] if found[:4] == b"CTRL"]
    assert all(any(stick) for stick in before)
    assert b"CTRL" in heads[first:]
    begin(driver)
    until(lambda: not bench.device.paused)


@pytest.mark.parametrize("lost", ["the request", "the question"])
def test_a_pause_that_is_lost_on_its_way_is_repeated_until_x_plane_says_that_it_stands_still(
    bench, driver, lost, monkeypatch
):
    monkeypatch.setattr("hardware_drivers.xplane_driver.HALT_S", 5.0)  # for a busy machine
    begin(driver)
    until(lambda: driver.step(trim()) and bench.command.any())
    head = {"the request": b"SIMU", "the question": b"GETD\0\1"}[lost]
    sent: list[bytes] = []

    def drop(datagram: bytes) -> bool:
        sent.extend([datagram] * datagram.startswith(head))
        return datagram.startswith(head) and len(sent) <= 3

    bench.device.drop = drop
    driver.make_safe()
    assert bench.device.paused
    assert len(sent) > 3


def test_an_x_plane_that_does_not_say_that_it_is_paused_is_one_line_within_two_seconds(bench):
    driver = backend_of(ROBOT, XPlaneDriver(ROBOT, settings_of(bench.device.address), patience_s=5.0))
    begin(driver)
    until(lambda: driver.step(trim()) and bench.command.any())
    bench.device.drop = lambda datagram: datagram[:4] == b"SIMU"
    began = time.monotonic()
    with pytest.raises(
        DeviceError, match=r"X-Plane at udp://\S+: 0\.3 s of PAUSE were not confirmed, .* by the key P"
    ):
        driver.close()
    assert time.monotonic() - began < 2.0
    assert not bench.device.paused


def test_every_command_moves_its_own_actuator_as_far_as_it_says(bench, driver):
    commands = [*(0.5 * np.diag(ROBOT.actuators.scale)), trim(), ROBOT.actuators.safe_command]
    for command in commands:
        driver.step(command)
        until(lambda command=command: np.allclose(bench.command, command, atol=1e-6))


def test_stick_and_pedals_are_x_plane_s_own_on_the_wire():
    """Nose down is a stick ahead, the right wing down a stick to the right, the nose to the left the left pedal."""
    received: dict[bytes, bytes] = {}
    with Peer(lambda datagram: received.__setitem__(datagram[:4], datagram)) as peer:
        driver = XPlaneDriver(ROBOT, settings_of(peer.address), patience_s=5.0)
        driver.write(np.array([1.0, 0.5, 1.0, 0.25, 0.75]) * ROBOT.actuators.scale)
        until(lambda: {b"CTRL", b"DREF"} <= set(received))
        driver.close()
    assert received[b"CTRL"] == bytes.fromhex("4354524c00 000080bf 0000003f 000080bf 008079c4 ff 008079c4 00")
    assert received[b"DREF"] == b"DREF\0\x20sim/flightmodel/engine/ENGN_thro\x02\0\0\x80\x3e\0\0\x40\x3f"


def banked(bench: XPlaneBench) -> bool:
    """Whether the left wing is up."""
    return bool(rotate(bench.sample.truth.quat_xyzw, np.array([0.0, 1.0, 0.0]))[2] > 0.05)


def test_odometry_inertial_unit_and_air_data_follow_the_aircraft(bench):
    """A turn to the right, frozen: what the driver then has is the very last frame."""
    settings = settings_of(bench.device.address, silent_s=5.0)
    driver = backend_of(ROBOT, XPlaneDriver(ROBOT, settings, patience_s=5.0))
    begin(driver)
    bank = trim() + np.array([0.0, 0.1, 0.0, 0.0, 0.0])
    until(lambda: driver.step(bank) and banked(bench))
    bench.device.paused = True
    sample = fly(driver, 0.15, bank)
    driver.close()
    found, true = sample.odometry, bench.sample.truth
    assert np.linalg.norm(true.position_in_world[:2] - START[:2]) > 2.0
    assert found.position_in_world == pytest.approx(true.position_in_world, abs=1e-4)
    assert found.velocity_in_world == pytest.approx(true.velocity_in_world, abs=1e-4)
    assert np.abs(found.quat_xyzw @ true.quat_xyzw) == pytest.approx(1.0, abs=1e-9)
    assert found.angular_velocity_in_body == pytest.approx(true.angular_velocity_in_body, abs=1e-4)
    assert sample.imu.angular_velocity == pytest.approx(true.angular_velocity_in_body, abs=1e-4)
    assert sample.imu.specific_force[2] == pytest.approx(9.8, abs=2.0)
    air = sample.readings["air_data"]
    assert air.value.names == ("airspeed", "alpha", "beta", "height")
    assert air.value.values == pytest.approx(bench.sample.readings["air_data"].value.values, abs=1e-4)
    assert 0 <= time.time_ns() - sample.stamp_ns < 2_000_000_000


MINE = "title: t\nrobot: ROBOT\ndriver: {kind: xplane, MORE}\n"


@pytest.mark.parametrize(
    ("robot", "more", "says"),
    [
        (
            "airship_v7",
            "port: tcp://localhost:1",
            r"must be udp://host:port; the plugin listens at port 49009",
        ),
        ("airship_v7", "silent_s: 60", "silent_s from 0.05 to 10 s"),
        ("airship_v7", "rate_hz: 0", "rate_hz must be from 1 to 1000 Hz"),
        ("airship_v7", "elevation: .nan", "elevation"),
        ("airship_v7", "origi: {latitude: 1, longitude: 1}", "Did you mean 'origin'"),
        ("kingfisher", "silent_s: 1", "driver 'xplane' cannot move 'kingfisher', which has propellers"),
    ],
)
def test_a_mistake_in_the_file_is_reported(tmp_path, robot, more, says):
    path = tmp_path / "mine.yaml"
    path.write_text(MINE.replace("ROBOT", robot).replace("MORE", more))
    with pytest.raises(ConfigError, match=says):
        load_hardware(str(path))
