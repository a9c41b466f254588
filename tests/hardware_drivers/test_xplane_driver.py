"""The driver of X-Plane against an emulated one at a UDP port: flight, and peers that vanish or lie."""

from __future__ import annotations

import re
import socket
import struct
import time
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.errors import ConfigError, DeviceError
from fulmar_core.rotation import rotate
from hardware_drivers.driver_backend import DriverBackend, backend_of
from hardware_drivers.hardware import load_hardware
from hardware_drivers.presence import check_presence
from hardware_drivers.settings import Geodetic, XPlane
from hardware_drivers.xplane_driver import XPlaneDriver
from tests.hardware_drivers.xplane_bench import ROBOT, START, Peer, XPlaneBench, episode_at, trim, until

ORIGIN = Geodetic(49.5, -3.0)
SILENT_S = 0.3


def settings_of(address: str, **more: object) -> XPlane:
    return replace(XPlane("xplane", address, origin=ORIGIN, silent_s=SILENT_S), **more)


@pytest.fixture
def bench():
    bench = XPlaneBench()
    yield bench
    bench.stop()


@pytest.fixture
def driver(bench):
    driver = backend_of(ROBOT, XPlaneDriver(ROBOT, settings_of(bench.device.address), patience_s=5.0))
    yield driver
    driver.close()


def fly(driver: DriverBackend, seconds: float, command: np.ndarray):
    """Fly with a command a hundred times a second; returns the last sample."""
    end = time.monotonic() + seconds
    while True:
        sample = driver.step(command)
        if time.monotonic() > end:
            return sample
        time.sleep(0.01)


def begin(driver: DriverBackend) -> None:
    driver.reset(episode_at(START), seed=0)


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


def wait_for_the_end(driver: DriverBackend | XPlaneDriver) -> str:
    """Why the driver gives up; until then, no lie comes through."""
    with pytest.raises(DeviceError) as found:
        for _ in range(200):
            odometry = (driver.step(trim()) if isinstance(driver, DriverBackend) else driver.read()).odometry
            assert np.linalg.norm(odometry.position_in_world[:2]) < 300.0
            assert np.linalg.norm(odometry.velocity_in_world) < 60.0
            time.sleep(0.01)
    return str(found.value)


def safe_at(bench: XPlaneBench) -> None:
    """Neutral surfaces and idle throttles have arrived."""
    until(lambda: np.allclose(bench.command, ROBOT.actuators.safe_command), timeout_s=5.0)


def test_an_x_plane_that_vanishes_is_one_line_and_a_safe_command(bench, driver):
    begin(driver)
    until(lambda: driver.step(trim()) and bench.command.any())
    bench.device.mute = True
    line = wait_for_the_end(driver)
    driver.make_safe()
    assert re.fullmatch(
        r"X-Plane at udp://127\.0\.0\.1:\d+: no report for \d+ ms \(limit 300 ms\).*\. Does X-Plane run there, "
        r"not paused, with the plugin XPlaneConnect\?",
        line,
    )
    safe_at(bench)


def posi(change: Callable[[list], None]) -> Callable[[bytes], bytes]:
    """A lie about the place alone."""

    def lie(answer: bytes) -> bytes:
        if not answer.startswith(b"POSI"):
            return answer
        fields = list(struct.unpack("<4sxB3d4f", answer))
        change(fields)
        return struct.pack("<4sxB3d4f", *fields)

    return lie


def resp(number: int, value: float) -> Callable[[bytes], bytes]:
    """A lie about one value of the second answer."""

    def lie(answer: bytes) -> bytes:
        if not answer.startswith(b"RESP"):
            return answer
        at = 6 + 5 * number
        return answer[:at] + struct.pack("<Bf", 1, value) + answer[at + 5 :]

    return lie


def far(fields: list) -> None:
    fields[2] += 0.05  # of latitude: 5.6 km


def to_the_equator(fields: list) -> None:
    fields[2] -= 49.5


def off_the_earth(fields: list) -> None:
    fields[2] = -998.0


def nowhere(fields: list) -> None:
    fields[4] = float("nan")


def coarse(answer: bytes) -> bytes:
    if not answer.startswith(b"POSI"):
        return answer
    return struct.pack("<4sxB7f", *struct.unpack("<4sxB3d4f", answer))


LIES = {
    "an altitude that is no number": (posi(nowhere), "POSI of 46 bytes: a number is not finite"),
    "a jump of 5 km": (posi(far), r"its place jumped by 55\d\d\.\d m within"),
    "a velocity of 900 m/s": (resp(0, 900.0), r"its speed 90\d\.\d\d m/s is beyond the possible 56 m/s"),
    "a turn rate that is infinite": (resp(6, float("inf")), "a number is not finite"),
    "a turn rate of 40 rad/s": (resp(7, 2300.0), r"its turn rate 40\.\d\d rad/s is beyond the possible 8"),
    "answers that are cut": (lambda answer: answer[:-3], "POSI of 43 bytes: must have 46|RESP of"),
    "answers of another protocol": (lambda answer: b"RREF," + answer[5:], "is no head of a datagram"),
    "counts that lie": (
        lambda answer: answer[:5] + b"\xff" + answer[6:],
        "a count goes beyond its end|aircraft 255",
    ),
    "unknown references": (
        lambda answer: answer[:6] + b"\0" + answer[11:] if answer.startswith(b"RESP") else answer,
        "RESP has no value of sim/flightmodel/position/local_vx",
    ),
    "places in float32": (coarse, "install XPlaneConnect 1.3"),
    "questions in the place of answers": (lambda _answer: b"GETP\0\0", "AskPosition was not asked for"),
}


FAST = ("an altitude that is no number", "a jump of 5 km", "a velocity of 900 m/s", "answers that are cut")


@pytest.mark.parametrize(
    "name", [*FAST, *(pytest.param(n, marks=pytest.mark.slow) for n in LIES if n not in FAST)]
)
def test_what_an_x_plane_that_lies_says_is_never_flown_by_and_one_line_says_why(peer, name):
    lie, says = LIES[name]
    for driver in driver_of(peer):
        peer.lie = lie
        line = wait_for_the_end(driver)
        assert re.search(rf"no report for \d+ ms \(limit 300 ms\); \d+ refused, the last: .*({says})", line)
        assert "\n" not in line
        assert re.search(says, driver.health()["warning"])
        assert int(driver.health()["refused_datagrams"]) > 1


def test_an_x_plane_that_lies_gets_the_safe_command(bench, driver):
    begin(driver)
    until(lambda: driver.step(trim()) and bench.command.any())
    bench.device.lie = LIES["a jump of 5 km"][0]
    wait_for_the_end(driver)
    driver.make_safe()
    safe_at(bench)


@pytest.fixture
def peer():
    with Peer() as peer:
        yield peer


def driver_of(peer: Peer, **more: object) -> Iterator[XPlaneDriver]:
    driver = XPlaneDriver(ROBOT, settings_of(peer.address, **more), patience_s=5.0)
    try:
        driver.begin(3.0, 2.0, 0.0)
        time.sleep(0.05)
        driver.read()
        yield driver
    finally:
        driver.close()


def test_without_an_origin_odometry_begins_at_the_start_pose_and_height_stays_above_the_water(peer):
    """The peer flies to the north, which is where its pose of (3, 2) m and 0° points."""
    for driver in driver_of(peer, origin=None, elevation=1.5):
        odometry = driver.read().odometry
        assert odometry.position_in_world[1:] == pytest.approx((2.0, 5.0 - 1.5), abs=1e-3)
        assert 3.0 < odometry.position_in_world[0] < 7.0
        assert odometry.velocity_in_world == pytest.approx((28.0, 0.0, 0.0), abs=1e-3)
        assert odometry.yaw == pytest.approx(0.0, abs=1e-6)


def test_the_very_first_report_of_a_flight_is_in_the_frame_of_its_start(peer):
    """The safe controller takes heading and height from it."""
    driver = XPlaneDriver(ROBOT, settings_of(peer.address, origin=None), patience_s=5.0)
    try:
        driver.begin(3.0, 2.0, 0.5)
        odometry = driver.read().odometry
    finally:
        driver.close()
    assert odometry.yaw == pytest.approx(0.5, abs=1e-6)
    assert odometry.position_in_world == pytest.approx((3.0, 2.0, 5.0), abs=2.0)


def test_an_x_plane_that_is_paused_in_flight_is_lost(peer):
    for driver in driver_of(peer):
        peer.lie = resp(13, 0.5)  # its clock
        assert "the last: X-Plane's time stands still. Does" in wait_for_the_end(driver)


def test_a_gap_that_is_shorter_than_the_limit_is_flown_through(peer):
    for driver in driver_of(peer):
        peer.lie = lambda _answer: b""
        for _ in range(10):
            time.sleep(0.01)
            driver.read()
        before, peer.lie = time.time_ns(), lambda answer: answer
        until(lambda before=before, driver=driver: driver.read().stamp_ns > before, timeout_s=5.0)


def test_one_datagram_that_is_spoilt_changes_nothing(peer):
    for driver in driver_of(peer):
        spoilt = iter([posi(far)])
        peer.lie = lambda answer, spoilt=spoilt: (
            next(spoilt, bytes)(answer) if answer.startswith(b"POSI") else answer
        )
        until(
            lambda driver=driver: driver.health() == {"refused_datagrams": "1", "warning": ""}, timeout_s=0.5
        )
        assert driver.read().odometry.position_in_world[:2] == pytest.approx((0.0, 10.0), abs=10.0)


def test_a_frame_whose_place_was_lost_is_not_reported_with_the_place_before(peer):
    for driver in driver_of(peer):
        peer.lie = lambda answer: b"" if answer.startswith(b"POSI") else answer
        time.sleep(0.03)  # what was under way
        before = driver.read().stamp_ns
        time.sleep(0.1)
        assert driver.read().stamp_ns == before


def test_an_aircraft_that_a_person_moves_before_the_start_is_measured_in_the_frame_of_where_it_then_is(peer):
    driver = XPlaneDriver(ROBOT, settings_of(peer.address, origin=None), patience_s=5.0)
    try:
        peer.lie = posi(to_the_equator)
        time.sleep(0.1)
        driver.begin(0.0, 0.0, 0.0)
        assert driver._frame.metres(0.0, -2.999)[0] == pytest.approx(111.3, abs=0.5)  # 72 at 49.5 degrees
    finally:
        driver.close()


def test_a_place_that_is_none_on_earth_is_refused(peer):
    for driver in driver_of(peer):
        peer.lie = posi(off_the_earth)
        until(lambda driver=driver: "latitude -998" in driver.health()["warning"], timeout_s=0.4)


def test_datagrams_of_a_stranger_are_not_received(peer):
    for driver in driver_of(peer):
        address = driver._port._socket.getsockname()
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
            for _ in range(50):
                stranger.sendto(b"POSI\0 nonsense", address)
        time.sleep(0.05)
        assert driver.health()["refused_datagrams"] == "0"


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def test_a_port_without_x_plane_is_refused_with_a_hint(monkeypatch):
    address = f"udp://127.0.0.1:{free_port()}"
    with pytest.raises(
        DeviceError, match=r"said nothing that can be read for 0\.1 s\. Does X-Plane run there"
    ):
        XPlaneDriver(ROBOT, settings_of(address), patience_s=0.1)
    monkeypatch.setattr("hardware_drivers.presence.CONNECT_S", 0.1)
    with pytest.raises(DeviceError, match=rf"{address}: no answer within 0\.1 s\. Does X-Plane run there"):
        check_presence(settings_of(address))


def test_an_x_plane_that_answers_is_present(peer, monkeypatch):
    check_presence(settings_of("udp://127.0.0.1:9"), peer.address)
    peer.lie = lambda _answer: b"HTTP/1.1 400"
    monkeypatch.setattr("hardware_drivers.presence.CONNECT_S", 0.1)
    with pytest.raises(DeviceError, match=r"no answer within 0\.1 s; what came: b'HTTP/' is no head"):
        check_presence(settings_of(peer.address))


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
