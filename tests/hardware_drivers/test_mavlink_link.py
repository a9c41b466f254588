"""A MAVLink link on a port whose bytes a test gives: whose messages count."""

from __future__ import annotations

from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from hardware_drivers.mavlink_link import MavlinkLink

BOAT, GIMBAL, STATION = mavlink.MAV_TYPE_SURFACE_BOAT, mavlink.MAV_TYPE_GIMBAL, mavlink.MAV_TYPE_GCS
ARDUPILOT, NONE = mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA, mavlink.MAV_AUTOPILOT_INVALID


class Port:
    """Has what others say, a packet for each read."""

    def __init__(self) -> None:
        self.coming: list[bytes] = []

    def read(self) -> bytes:
        return self.coming.pop(0) if self.coming else b""

    def say(self, message: Any, system: int, component: int = 1) -> None:
        sender = mavlink.MAVLink(None, srcSystem=system, srcComponent=component)
        self.coming.append(bytes(message.pack(sender)))


def beat(kind: int = BOAT, autopilot: int = ARDUPILOT) -> Any:
    return mavlink.MAVLink_heartbeat_message(kind, autopilot, mavlink.MAV_MODE_FLAG_SAFETY_ARMED, 0, 4, 3)


@pytest.fixture
def port():
    return Port()


@pytest.fixture
def link(port):
    return MavlinkLink(port)


def test_the_first_autopilot_that_speaks_is_the_one(port, link):
    port.say(beat(), 7)
    assert [message.get_type() for message in link.receive()] == ["HEARTBEAT"]
    assert link.autopilot == (7, 1)


@pytest.mark.parametrize("kind", [GIMBAL, STATION])
def test_a_gimbal_or_a_ground_station_is_no_autopilot(port, link, kind):
    port.say(beat(kind, NONE), 7)
    assert link.receive() == []
    assert link.autopilot is None


@pytest.mark.parametrize("other", [(8, 1), (7, 154)])
def test_what_others_say_on_the_link_of_an_autopilot_is_dropped_and_counted(port, link, other):
    port.say(beat(), 7)
    link.receive()
    port.say(beat(), *other)
    assert link.receive() == []
    assert (link.autopilot, link.refused) == ((7, 1), 1)
    assert link.refusal == f"it is of system {other[0]}, component {other[1]}"


def test_nothing_but_a_heartbeat_makes_an_autopilot(port, link):
    port.say(mavlink.MAVLink_statustext_message(3, b"I am one"), 7)
    assert link.receive() == []
    assert link.autopilot is None
