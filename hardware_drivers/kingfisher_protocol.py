"""Sentences of the Kingfisher's front seat, the host's side.

Clearpath's boats of this family (Kingfisher, Heron, M200) take `$PYDIR,left,right` in percent, and report place and
attitude (`$CPNVG`), velocities (`$CPNVR`) and the inertial unit (`$CPIMU`). No specification is public; the fields are
those that the open iM200 application of MOOS-IvP reads, and its recording of a real boat is a test of ours.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fulmar_core.robots.sensors.imu import ImuSample
from hardware_drivers.wiring import bounded

GRAVITY = 9.80665  # [m/s²]; the recorded boat reports accelerations in multiples of it, with z down
DAY_S = 86400.0
LARGEST = 1e6  # of any field; beyond it is nonsense, of which conversions could make what is not finite
OLDEST_SPEED_S = 0.5  # a velocity that came longer before a position says nothing about it


@dataclass(frozen=True)
class Fix:
    """`$CPNVG`: where the boat is and how it lies."""

    time_s: float  # of the day, UTC [s]
    latitude: float  # [deg]
    longitude: float  # [deg]
    heading: float  # clockwise from true north [deg]
    roll: float  # starboard down [deg]
    pitch: float  # bow up [deg]


@dataclass(frozen=True)
class NoFix:
    """`$CPNVG` of a boat that does not know where it is."""


@dataclass(frozen=True)
class Rates:
    """`$CPNVR`: how the boat moves."""

    time_s: float
    east: float  # [m/s]
    north: float  # [m/s]
    yaw_rate: float  # clockwise from above [deg/s]


@dataclass(frozen=True)
class Inertial:
    """`$CPIMU`, in the axes of ROS: x ahead, y to port, z up."""

    time_s: float
    reading: ImuSample


@dataclass(frozen=True)
class Battery:
    """`$CPRBS`: one battery."""

    voltage: float  # [V]


Message = Fix | NoFix | Rates | Inertial | Battery


def drive(left: float, right: float) -> bytes:
    """The sentence that makes the propellers turn.

    Args:
        left: Share of full thrust, -1 to 1; see `bounded`.
        right: Same.
    """
    return sentence("PYDIR," + ",".join(f"{100.0 * share:.1f}" for share in bounded(left, right)))


def read(fields: list[str]) -> Message | None:
    """Understand a sentence.

    Args:
        fields: Of a sound sentence, its name first.

    Returns:
        What it says; None where it says nothing that a driver needs, or nonsense.
    """
    reader = READERS.get(fields[0])
    try:
        message = reader(fields) if reader else None
    except (ValueError, IndexError):
        return None
    return message


def _fix(fields: list[str]) -> Fix | NoFix | None:
    if fields[6] == "0":
        return NoFix()
    if fields[6] != "1" or fields[3] not in ("N", "S") or fields[5] not in ("E", "W"):
        return None
    latitude = _degrees(fields[2]) * (1.0 if fields[3] == "N" else -1.0)
    longitude = _degrees(fields[4]) * (1.0 if fields[5] == "E" else -1.0)
    if abs(latitude) > 90.0 or abs(longitude) > 180.0:
        return None
    heading, roll, pitch = (_number(field) for field in fields[9:12])
    return Fix(_time(fields, 12), latitude, longitude, heading, roll, pitch)


def _rates(fields: list[str]) -> Rates:
    return Rates(_time(fields, -1), _number(fields[2]), _number(fields[3]), _number(fields[7]))


def _inertial(fields: list[str]) -> Inertial:
    wx, wy, wz, ax, ay, az = (_number(field) for field in fields[2:8])
    turn = np.radians((wx, -wy, -wz))
    return Inertial(_time(fields, 8), ImuSample(GRAVITY * np.array([ax, -ay, -az]), turn))


def _battery(fields: list[str]) -> Battery:
    return Battery(_number(fields[3]))


READERS = {"CPNVG": _fix, "CPNVR": _rates, "CPIMU": _inertial, "CPRBS": _battery}


def _number(text: str) -> float:
    """A number of sensible size, as NMEA writes it; raises ValueError."""
    value = float(text)
    if not abs(value) <= LARGEST or "_" in text:
        raise ValueError(text)
    return value


def _degrees(text: str) -> float:
    """Degrees and minutes in one number, as in 4221.711142."""
    value = _number(text)
    degrees, minutes = divmod(value, 100.0)
    if value < 0.0 or minutes >= 60.0:
        raise ValueError(text)
    return degrees + minutes / 60.0


def _time(fields: list[str], own: int) -> float:
    """Time of the measurement where the sentence has one, else of the sentence, as in 164958.858 [s of the day]."""
    text = fields[own] if 0 < own < len(fields) and fields[own] else fields[1]
    value = _number(text)
    hours, rest = divmod(value, 10000.0)
    minutes, seconds = divmod(rest, 100.0)
    time_s = 3600.0 * hours + 60.0 * minutes + seconds
    if not value >= 0.0 or minutes >= 60.0 or not time_s < DAY_S + 2.0:
        raise ValueError(text)
    return time_s


LONGEST = 256  # characters; NMEA itself stops at 82, the Kingfisher's sentences go on a little longer


def sentence(body: str) -> bytes:
    """A sentence ready to be sent.

    Args:
        body: What stands between `$` and `*`, in ASCII.
    """
    return f"${body}*{checksum(body.encode('ascii')):02X}\r\n".encode("ascii")


def checksum(body: bytes) -> int:
    """Exclusive or of all characters."""
    total = 0
    for byte in body:
        total ^= byte
    return total


class Decoder:
    """Finds sentences in a byte stream; skips damaged ones, keeps partial ones.

    Attributes:
        lost: Lines that were no sound sentence.
    """

    def __init__(self) -> None:
        self._pending = bytearray()
        self.lost = 0

    def feed(self, data: bytes) -> list[list[str]]:
        """Take bytes.

        Returns:
            Fields of the sentences that are complete now, in their order; the first field is the name.
        """
        self._pending += data
        *lines, rest = self._pending.split(b"\n")
        if len(rest) > LONGEST:
            self.lost += 1
            rest = bytearray()
        self._pending = bytearray(rest)
        found = (_fields(bytes(line)) for line in lines)
        sound = [fields for fields in found if fields]
        self.lost += len(lines) - len(sound)
        return sound


def _fields(line: bytes) -> list[str]:
    """Fields of a line, none where it is no sound sentence."""
    line = line.strip()
    start = line.rfind(b"$")
    body, star, total = line[start + 1 :].partition(b"*")
    if start < 0 or not star or len(total) != 2 or len(line) > LONGEST or not body.isascii():
        return []
    try:
        right = int(total, 16) == checksum(body)
    except ValueError:
        return []
    return body.decode("ascii").split(",") if right else []
