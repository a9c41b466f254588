"""Reads what comes each tick, odometry and states of actuators, from its serialized bytes. Knows no ROS.

Ten robots send a thousand such messages a second. As objects of rclpy they would take the console three times as much
processor time as all the rest of it.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

HEAD = 4  # bytes before the content, which say how it is encoded; alignment counts from here
PLAIN_CDR = (0, 1)  # kinds of encoding that are read: big and little endian
POSE = 7
MOST_NAMES = 1000


class UnreadableError(ValueError):
    """Bytes that are no such message."""


@dataclass(frozen=True)
class Placed:
    """The part of an odometry that is drawn: stamp [ns], and x, y, z and the quaternion x, y, z, w."""

    stamp_ns: int
    pose: tuple[float, ...]


def read_odometry(data: bytes) -> Placed:
    """Stamp and pose of a `nav_msgs/Odometry`.

    Raises:
        UnreadableError: It is none.
    """
    try:
        order = _order(data)
        at = HEAD
        seconds, nanoseconds = struct.unpack_from(f"{order}iI", data, at)
        at = _after_text(order, data, at + 8)
        at = _aligned(_after_text(order, data, at), 8)
        return Placed(seconds * 10**9 + nanoseconds, struct.unpack_from(f"{order}{POSE}d", data, at))
    except (struct.error, IndexError) as error:
        raise UnreadableError(str(error)) from error


class JointReader:
    """Reads `sensor_msgs/JointState` of one publisher, whose names stay the same from one to the next.

    Attributes:
        names: Of the newest message.
    """

    def __init__(self) -> None:
        """Begin."""
        self.names: tuple[str, ...] = ()
        self._start, self._values_at = b"\x00", 0  # the bytes from frame to names, and where they end

    def read(self, data: bytes) -> tuple[float, ...]:
        """Efforts by name, or positions where it has no efforts.

        Raises:
            UnreadableError: It is none, or has no value for each name.
        """
        try:
            order = _order(data)
            if not data.startswith(self._start, HEAD + 8):
                self._read_names(order, data)
            at, found = self._values_at, []
            for _ in range(3):
                at = _aligned(at, 4)
                (count,) = struct.unpack_from(f"{order}I", data, at)
                at = _aligned(at + 4, 8) if count else at + 4
                found.append(struct.unpack_from(f"{order}{count}d", data, at) if count <= MOST_NAMES else ())
                at += 8 * count
        except (struct.error, IndexError, UnicodeDecodeError) as error:
            raise UnreadableError(str(error)) from error
        for values in (found[2], found[0]):
            if len(values) == len(self.names):
                return values
        raise UnreadableError("it has no value for each name")

    def _read_names(self, order: str, data: bytes) -> None:
        at = _aligned(_after_text(order, data, HEAD + 8), 4)
        (count,) = struct.unpack_from(f"{order}I", data, at)
        if count > MOST_NAMES:
            raise UnreadableError(f"it has {count} names")
        at += 4
        names = []
        for _ in range(count):
            at = _aligned(at, 4)
            end = _after_text(order, data, at)
            names.append(data[at + 4 : end - 1].decode())
            at = end
        self.names, self._start, self._values_at = tuple(names), bytes(data[HEAD + 8 : at]), at


def _order(data: bytes) -> str:
    """Byte order, as `struct` calls it."""
    if data[0] or data[1] not in PLAIN_CDR:
        raise UnreadableError("its encoding is not plain CDR")
    return "<" if data[1] else ">"


def _after_text(order: str, data: bytes, at: int) -> int:
    """Where a text ends whose length is at or right after a position."""
    at = _aligned(at, 4)
    (length,) = struct.unpack_from(f"{order}I", data, at)
    if not 0 < length <= len(data) - at - 4:
        raise UnreadableError("a text is longer than the message")
    return int(at + 4 + length)


def _aligned(at: int, size: int) -> int:
    """The next position at a multiple of a size, counted from the end of the head."""
    return at + (HEAD - at) % size
