"""Kobuki's serial protocol, the host's side: commands as bytes, bytes as reports.

A packet is AA 55, the length of the payload, the payload, and the exclusive or of all bytes after the two first. A
payload is a row of parts: identifier, length, data, little endian. Source: Kobuki's protocol specification
(docs.ros.org, kobuki_driver, appendix) and kobuki-base/kobuki_core.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

HEAD = b"\xaa\x55"
BASE_CONTROL = 0x01
CORE_SENSORS, INERTIA = 0x01, 0x04
CORE = struct.Struct("<HBBBHHbbBBBB")
INERTIAL = struct.Struct("<hhxxx")
SHORTEST, LONGEST = 3, 250  # of a payload [bytes]

WHEEL_RADIUS = 0.035  # [m]
COUNT = 0.002436916871363930  # angle of a wheel between two counts [rad]
TRACK = 0.23  # [m]
WRAP_MS = 1 << 16  # its clock counts milliseconds in 16 bits

RIGHT, CENTRE, LEFT = 1, 2, 4  # bits of bumpers and cliff sensors; wheel drop has 1 and 2, right and left


@dataclass(frozen=True)
class CoreSensors:
    """What the base reports fifty times a second."""

    time_ms: int  # 0 to 65535
    bumpers: int  # bits
    wheel_drops: int
    cliffs: int
    left: int  # encoder counts, 0 to 65535
    right: int
    battery: float  # [V]
    overcurrent: int  # bits: left and right wheel


@dataclass(frozen=True)
class Inertia:
    """Its gyroscope, counter-clockwise from above."""

    angle: float  # [deg]
    rate: float  # [deg/s]


@dataclass(frozen=True)
class Packet:
    """The parts of one packet that a driver needs; None: it has no such part."""

    core: CoreSensors | None
    inertia: Inertia | None


def packet(payload: bytes) -> bytes:
    """A payload of at most 255 bytes with everything around it."""
    body = bytes([len(payload)]) + payload
    return HEAD + body + bytes([checksum(body)])


def checksum(body: bytes | bytearray) -> int:
    """Exclusive or of all bytes."""
    total = 0
    for byte in body:
        total ^= byte
    return total


def base_control(speed: float, turn_rate: float) -> bytes:
    """The packet that makes the base drive.

    The base takes the speed of the outer wheel in mm/s and the radius of the arc in mm: 0 stands for a straight line,
    1 for turning on the spot.

    Args:
        speed: Ahead [m/s].
        turn_rate: To the left [rad/s].
    """
    ahead, half = 1e3 * speed, 5e2 * TRACK
    if abs(turn_rate) < 1e-4:
        pair = (ahead, 0.0)
    elif abs(ahead / turn_rate) <= 1.0:
        pair = (half * turn_rate, 1.0)
    elif abs(ahead / turn_rate) > 32767.0:  # straighter than the protocol can say
        pair = (ahead, 0.0)
    else:
        radius = ahead / turn_rate
        pair = ((radius + half if radius > 0.0 else radius - half) * turn_rate, radius)
    values = (max(-32768, min(32767, round(value))) for value in pair)
    return packet(struct.pack("<BBhh", BASE_CONTROL, 4, *values))


class Decoder:
    """Finds packets in a byte stream; skips damaged ones, keeps partial ones.

    Attributes:
        lost: Bytes that belong to no sound packet.
    """

    def __init__(self) -> None:
        self._pending = bytearray()
        self.lost = 0

    def feed(self, data: bytes) -> list[Packet]:
        """Take bytes; returns the packets that are complete now, in their order."""
        self._pending += data
        found = []
        while (payload := self._next()) is not None:
            found.append(_parts(payload))
        return found

    def _next(self) -> bytes | None:
        pending = self._pending
        while True:
            start = pending.find(HEAD)
            if start < 0:
                self._drop(len(pending) - pending.endswith(HEAD[:1]))
                return None
            self._drop(start)
            if len(pending) < 3:
                return None
            length = pending[2]
            if not SHORTEST <= length <= LONGEST:
                self._drop(1)
                continue
            if len(pending) < length + 4:
                return None
            if checksum(pending[2 : length + 4]):  # with its own checksum, a sound body gives zero
                self._drop(1)
                continue
            payload = bytes(pending[3 : length + 3])
            del pending[: length + 4]
            return payload

    def _drop(self, count: int) -> None:
        self.lost += count
        del self._pending[:count]


def _parts(payload: bytes) -> Packet:
    core, inertia = None, None
    at = 0
    while at + 2 <= len(payload):
        kind, length = payload[at], payload[at + 1]
        data = payload[at + 2 : at + 2 + length]
        if len(data) == length:
            if kind == CORE_SENSORS and length == CORE.size:
                time_ms, bumpers, drops, cliffs, left, right, _, _, _, _, battery, over = CORE.unpack(data)
                core = CoreSensors(time_ms, bumpers, drops, cliffs, left, right, 0.1 * battery, over)
            elif kind == INERTIA and length == INERTIAL.size:
                angle, rate = INERTIAL.unpack(data)
                inertia = Inertia(0.01 * angle, 0.01 * rate)
        at += 2 + length
    return Packet(core, inertia)
