"""The driver of a Kingfisher on a port whose bytes a test gives."""

from __future__ import annotations

import threading

import pytest

from fulmar_core.robots.robot_file import load_robot
from hardware_drivers import kingfisher_driver
from hardware_drivers.kingfisher_driver import KingfisherDriver
from hardware_drivers.kingfisher_protocol import OLDEST_SPEED_S, sentence
from hardware_drivers.settings import KingfisherNmea, Thrust


class Port:
    """Hands a sentence on at a time, and keeps what is written."""

    def __init__(self) -> None:
        self.coming: list[bytes] = []
        self.written: list[bytes] = []
        self.read_all = threading.Event()

    def read(self) -> bytes:
        if self.coming:
            return self.coming.pop(0)
        self.read_all.set()
        threading.Event().wait(0.002)
        return b""

    def write(self, data: bytes) -> None:
        self.written.append(data)

    def close(self) -> None:
        pass

    def say(self, *bodies: str) -> None:
        """Let sentences come, and wait until they were read."""
        self.coming += [sentence(body) for body in bodies]
        for _ in range(2):  # what was read before the event is taken by then
            self.read_all.clear()
            assert self.read_all.wait(5.0)


def fix(seconds: float, minutes: float = 21.71) -> str:
    clock = f"1649{seconds:06.3f}"
    return f"CPNVG,{clock},42{minutes:.5f},N,7105.44878,W,1,0,0,234.0,0,0,{clock}"


def rates(seconds: float) -> str:
    return f"CPNVR,1649{seconds:06.3f},0.03,-0.07,0,0.06,0,-0.06"


@pytest.fixture
def boat(monkeypatch):
    """A driver that has its first report, and its port."""
    port = Port()
    monkeypatch.setattr(kingfisher_driver, "open_port", lambda *_: port)
    port.coming = [sentence(rates(0.0)), sentence(fix(0.0))]
    driver = KingfisherDriver(
        load_robot("kingfisher"),
        KingfisherNmea("kingfisher_nmea", "port", Thrust(45.0, 25.0)),
        patience_s=5.0,
    )
    yield driver, port
    driver.close()


def test_a_fix_without_a_recent_velocity_is_no_report(boat):
    driver, port = boat
    first = driver.read()
    port.say(fix(OLDEST_SPEED_S + 0.1))
    assert driver.read() is first
    port.say(rates(1.0), fix(1.0))
    assert driver.read() is not first


def test_a_fix_that_jumps_is_refused_and_counted(boat):
    driver, port = boat
    first = driver.read()
    port.say(rates(1.0), fix(1.0, minutes=25.0))
    assert driver.read() is first
    assert driver.health()["refused_positions"] == "1"


def test_a_fix_that_the_boat_does_not_have_is_said(boat):
    driver, port = boat
    port.say(fix(1.0).replace(",W,1,", ",W,0,"))
    assert driver.health()["warning"] == "the boat has no fix of its position"
