"""The driver of X-Plane beside peers that vanish, lie or are not there, and where their answers are on earth."""

from __future__ import annotations

import re
import socket
import struct
import time
from collections.abc import Callable, Iterator

import numpy as np
import pytest

from fulmar_core.config.errors import DeviceError
from hardware_drivers.driver_backend import DriverBackend
from hardware_drivers.presence import check_presence
from hardware_drivers.xplane_driver import XPlaneDriver
from tests.hardware_drivers.xplane_bench import (
    ROBOT,
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
