"""The boats' drivers against emulated boats: NMEA over a serial port and over TCP, MAVLink over UDP."""

from __future__ import annotations

import os
import pty
import socket
import threading
import time
import tty
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from pymavlink import mavutil

from fulmar_core.config.errors import ConfigError, DeviceError
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.states.planar import PlanarState
from hardware_drivers.driver_backend import backend_of
from hardware_drivers.kingfisher_driver import KingfisherDriver
from hardware_drivers.mavlink_autopilot import ARMED
from hardware_drivers.mavlink_driver import NO_CHANGE, MavlinkDriver, override_of
from hardware_drivers.mavlink_telemetry import state_of
from hardware_drivers.ports import open_port
from hardware_drivers.settings import KingfisherNmea, MavlinkBoat, Thrust
from sim_nodes.emulators.ardupilot import ArdupilotEmulator
from sim_nodes.emulators.device import PtyLink, TcpLink
from sim_nodes.emulators.kingfisher import KingfisherEmulator
from tests.hardware_drivers.bench import Bench, episode_at, until

START = (3.0, -2.0, 0.7)
THRUST = Thrust(45.0, 25.0)
KINDS = ("serial", "tcp", "mavlink")


@pytest.fixture(params=KINDS)
def kind(request) -> str:
    return request.param


@pytest.fixture
def bench(kind, tmp_path, unused_udp_port):
    def device(_backend):
        if kind == "mavlink":
            return ArdupilotEmulator(unused_udp_port)
        return KingfisherEmulator(PtyLink(tmp_path / "serial") if kind == "serial" else TcpLink(0))

    bench = Bench("kingfisher", device, start=START)
    yield bench
    bench.stop()


@pytest.fixture
def unused_udp_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@pytest.fixture
def driver(bench, kind):
    if kind == "mavlink":
        made: Any = MavlinkDriver(
            bench.robot, MavlinkBoat("mavlink_boat", bench.device.address, THRUST, arm=True), patience_s=5.0
        )
    else:
        settings = KingfisherNmea("kingfisher_nmea", bench.device.address, THRUST)
        made = KingfisherDriver(bench.robot, settings, patience_s=5.0)
    made = backend_of(bench.robot, made)
    made.reset(episode_at(bench.robot, *START), seed=0)
    yield made
    made.close()


def drive(driver, command, seconds):
    """Send a command fifty times a second."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        sample = driver.step(np.array(command))
        time.sleep(0.02)
    return sample


def test_the_propellers_turn_as_commanded_each_on_its_side(bench, driver):
    until(
        lambda: driver.step(np.array([0.8, -0.4])) and bench.command == pytest.approx([0.8, -0.4], abs=0.003)
    )


def test_odometry_follows_the_boat_in_ros_frames(bench, driver):
    for command in ((1.0, 1.0), (0.3, 1.0), (0.0, 0.0)):
        sample = drive(driver, command, 1.2)
    found, true = PlanarState.from_rigid(sample.odometry), PlanarState.from_rigid(bench.sample.truth)
    assert np.hypot(true.x - START[0], true.y - START[1]) > 0.2
    assert np.hypot(found.x - true.x, found.y - true.y) < 0.1  # a tenth of a second old
    assert abs(np.remainder(found.yaw - true.yaw + np.pi, 2 * np.pi) - np.pi) < np.radians(3.0)
    assert np.hypot(found.vx - true.vx, found.vy - true.vy) < 0.1
    assert sample.imu.specific_force[2] == pytest.approx(9.80665, abs=0.02)
    assert 0 <= time.time_ns() - sample.stamp_ns < 250_000_000


def test_closing_stops_the_propellers(bench, driver):
    drive(driver, (1.0, 1.0), 0.3)
    assert bench.command.any()
    driver.close()
    until(lambda: not bench.command.any(), timeout_s=0.3)


def test_a_boat_that_falls_silent_is_an_error_not_old_odometry(bench, driver):
    bench.device.mute = True
    with pytest.raises(DeviceError, match=r"no report for 1\d\d\d ms"):
        drive(driver, (0.0, 0.0), 2.0)


@pytest.mark.parametrize("kind", ["serial"], indirect=True)
def test_a_boat_without_a_fix_says_so(bench, driver):
    bench.device.lost = True
    with pytest.raises(DeviceError, match="refused, the last: the boat has no fix of its position"):
        drive(driver, (0.0, 0.0), 3.0)
    assert driver.health()["warning"] == "the boat has no fix of its position"


@pytest.mark.parametrize("kind", ["serial"], indirect=True)
def test_a_place_of_the_boat_that_jumps_is_refused(bench, driver):
    """Thirty metres for an instant, as by a reflected signal; then it is back."""
    report, steps = bench.device.report, iter(range(100))

    def elsewhere(sample, now_s):
        away = 30.0 if next(steps, 99) < 20 else 0.0
        sample.odometry.position_in_world[0] += away
        report(sample, now_s)
        sample.odometry.position_in_world[0] -= away

    bench.device.report = elsewhere
    for _ in range(60):
        sample = drive(driver, (0.0, 0.0), 0.02)
        assert sample.odometry.position_in_world[:2] == pytest.approx(START[:2], abs=0.1)
    assert int(driver.health()["refused_positions"]) > 0
    assert driver.health()["warning"] == ""


@pytest.mark.parametrize("kind", ["tcp"], indirect=True)
def test_a_closed_connection_is_reported_at_once(bench, driver):
    bench.device.mute = True
    bench.device._link._drop()
    with pytest.raises((DeviceError, OSError)):
        drive(driver, (0.0, 0.0), 0.5)


@pytest.mark.parametrize("kind", ["mavlink"], indirect=True)
def test_an_autopilot_without_its_host_holds_by_its_own_failsafe(bench, driver):
    drive(driver, (1.0, 1.0), 0.5)
    driver._driver._session.over.set()  # as a process that was killed: neither heartbeats nor overrides
    driver._driver._session._thread.join()
    silent = time.monotonic()
    until(lambda: not bench.command.any())
    assert time.monotonic() - silent < 3.2


@pytest.mark.parametrize("kind", ["mavlink"], indirect=True)
def test_an_autopilot_that_may_not_arm_is_measured_and_sent_no_command(bench):
    """Neither mode, nor arming, nor override, at any call; odometry comes, and the reason is a warning."""
    received: list[str] = []
    take = bench.device._take
    bench.device._take = lambda message, now_s: received.append(describe(message)) or take(message, now_s)
    settings = MavlinkBoat("mavlink_boat", bench.device.address, THRUST)
    driver = backend_of(bench.robot, MavlinkDriver(bench.robot, settings, patience_s=5.0))
    driver.reset(episode_at(bench.robot, *START), seed=0)
    sample = drive(driver, (1.0, 1.0), 0.3)
    assert sample.odometry is not None
    assert not sample.applied.any()
    assert driver.health()["warning"] == "not armed: arm: true or --arm"
    driver.make_safe()
    driver.close()
    time.sleep(0.1)
    assert set(received) == {"HEARTBEAT", f"COMMAND_LONG {mavutil.mavlink.MAV_CMD_SET_MESSAGE_INTERVAL}"}
    assert not bench.command.any()


def describe(message) -> str:
    """Kind of a MAVLink message, with the number of a command."""
    kind = message.get_type()
    return f"{kind} {message.command}" if kind == "COMMAND_LONG" else kind


def test_nobody_at_the_other_end_is_refused_with_a_hint(unused_udp_port):
    robot = load_robot("kingfisher")
    with pytest.raises(DeviceError, match="no heartbeat"):
        MavlinkDriver(
            robot, MavlinkBoat("mavlink_boat", f"udpin:127.0.0.1:{unused_udp_port}", THRUST), patience_s=0.2
        )


@pytest.fixture
def cable(tmp_path) -> Iterator[Callable[[], None]]:
    """Serial port of an autopilot that reports from the first moment on, and never reads; plugged in when called."""
    host, device = pty.openpty()
    tty.setraw(device)
    over = threading.Event()
    mav = mavutil.mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
    said = (
        mav.heartbeat_encode(11, mavutil.mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA, ARMED, 0, 4),
        mav.attitude_encode(1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        mav.local_position_ned_encode(1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    )

    def report() -> None:
        while not over.wait(0.02):
            os.write(host, b"".join(message.pack(mav) for message in said))

    thread = threading.Thread(target=report)

    def plug() -> None:
        (tmp_path / "serial").symlink_to(os.ttyname(device))
        thread.start()

    yield plug
    over.set()
    if thread.ident:
        thread.join()
    os.close(host)
    os.close(device)


def test_a_serial_autopilot_is_waited_for_and_a_cable_that_takes_no_more_is_an_error_and_no_wait(
    cable, tmp_path
):
    threading.Timer(0.5, cable).start()
    boat = MavlinkBoat("mavlink_boat", str(tmp_path / "serial"), THRUST, arm=True)
    robot = load_robot("kingfisher")
    driver = backend_of(robot, MavlinkDriver(robot, boat, patience_s=5.0))
    began = time.monotonic()
    with pytest.raises(OSError, match=r"more bytes|unavailable"):
        for _ in range(5000):
            driver.step(np.zeros(2))
    assert time.monotonic() - began < 5.0
    driver.close()


def test_a_missing_serial_port_is_reported_with_a_hint(tmp_path):
    boat = MavlinkBoat("mavlink_boat", str(tmp_path / "none"), THRUST)
    with pytest.raises(DeviceError, match=r"none cannot be opened: .*Is the device connected"):
        MavlinkDriver(load_robot("kingfisher"), boat, patience_s=0.2)


@pytest.mark.parametrize("kind", ["mavlink"], indirect=True)
def test_only_the_autopilot_itself_says_that_it_is_armed(bench, driver):
    """Not a gimbal of the same system, whose heartbeats come in between."""
    host, _, number = bench.device.address.removeprefix("udpin:").partition(":")
    gimbal = mavutil.mavlink.MAVLink(None, srcSystem=1, srcComponent=154)
    until(lambda: driver.step(np.zeros(2)) and driver.health()["armed"] == "true")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        for _ in range(20):
            beat = gimbal.heartbeat_encode(26, mavutil.mavlink.MAV_AUTOPILOT_INVALID, 0, 0, 4)
            other.sendto(beat.pack(gimbal), (host, int(number)))
            time.sleep(0.01)
            assert driver.health()["armed"] == "true"


def test_a_gimbal_alone_is_no_autopilot(unused_udp_port):
    gimbal = mavutil.mavlink_connection(
        f"udpout:127.0.0.1:{unused_udp_port}", source_system=1, source_component=154
    )
    over = threading.Event()

    def beat() -> None:
        while not over.wait(0.02):
            gimbal.mav.heartbeat_send(26, mavutil.mavlink.MAV_AUTOPILOT_INVALID, 0, 0, 4)

    thread = threading.Thread(target=beat)
    thread.start()
    boat = MavlinkBoat("mavlink_boat", f"udpin:127.0.0.1:{unused_udp_port}", THRUST)
    try:
        with pytest.raises(DeviceError, match="no heartbeat"):
            MavlinkDriver(load_robot("kingfisher"), boat, patience_s=0.3)
    finally:
        over.set()
        thread.join()
        gimbal.close()


def test_an_address_that_is_none_is_refused():
    with pytest.raises(ConfigError, match="tcp://host:port"):
        open_port("tcp://host", 0, 0.0)


@pytest.mark.parametrize(
    ("command", "steering", "throttle"),
    [
        ((1.0, 1.0), 1500, 1900),
        ((1.0, -1.0), 1900, 1500),
        ((-9.0, -9.0), 1500, 1100),
        ((float("nan"), 1.0), 1500, 1500),
        ((1.0, float("inf")), 1500, 1500),
    ],
)
def test_pulses_stay_within_their_span_and_what_is_no_number_is_a_stop(command, steering, throttle):
    channels = override_of(MavlinkBoat("mavlink_boat", "", THRUST), *command)
    assert channels == [steering, NO_CHANGE, throttle, *[NO_CHANGE] * 5]


@dataclass
class Said:
    """A MAVLink message by its fields."""

    time_boot_ms: int = 1000
    x: float = 1.0
    y: float = 2.0
    z: float = 0.5
    vx: float = 0.0
    vy: float = 0.0
    vz: float = 0.0
    roll: float = 0.0
    pitch: float = 0.0
    yaw: float = 0.0
    rollspeed: float = 0.0
    pitchspeed: float = 0.0
    yawspeed: float = 0.1


def test_north_east_down_becomes_east_north_up():
    state = state_of(Said(), Said())
    assert state.position_in_world.tolist() == [2.0, 1.0, -0.5]
    assert float(state.yaw) == pytest.approx(np.pi / 2)  # bow to the north
    assert state.angular_velocity_in_body[2] == pytest.approx(-0.1)


@pytest.mark.parametrize("spoilt", [{"x": float("nan")}, {"vy": float("inf")}, {"time_boot_ms": 5000}])
def test_an_estimate_that_is_not_finite_or_not_of_one_time_is_none(spoilt):
    assert state_of(Said(**spoilt), Said()) is None


@pytest.mark.parametrize("kind", ["mavlink"], indirect=True)
def test_noise_beside_the_autopilot_changes_nothing(bench, driver):
    """Random datagrams, and cut and spoilt ones of the autopilot's own, from another sender."""
    rng = np.random.default_rng(1)
    host, _, number = bench.device.address.removeprefix("udpin:").partition(":")
    packet = bytes(
        bench.device._link.mav.attitude_encode(1, 9.0, 9.0, 9.0, 9.0, 9.0, 9.0).pack(bench.device._link.mav)
    )
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as noise:
        for _ in range(300):
            spoilt = bytearray(packet[: rng.integers(1, len(packet))])
            spoilt[rng.integers(len(spoilt))] ^= int(rng.integers(1, 256))
            for data in (rng.bytes(int(rng.integers(1, 280))), bytes(spoilt)):
                noise.sendto(data, (host, int(number)))
    sample = drive(driver, (0.0, 0.0), 0.5)
    place = sample.odometry.position_in_world[:2]
    assert place == pytest.approx(START[:2], abs=0.05)
    assert not bench.command.any()
