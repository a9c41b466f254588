"""Message types of Jazzy without ROS: definitions, hashes, QoS, and the layout of a message in CDR.

The texts come from the Jazzy type store of `rosbags`, so a bag can be written without ROS.
"""

from __future__ import annotations

import contextlib
import functools
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from rosbags.interfaces import Nodetype
from rosbags.serde import SerdeError
from rosbags.typesys import Stores, get_typestore
from rosbags.typesys.store import Typestore

from fulmar_core.config.errors import BagError
from fulmar_core.robots.topics import Delivery

# The value of an unset duration in rmw.
_FOREVER = {"sec": 9223372036, "nsec": 854775807}


@dataclass(frozen=True)
class MessageType:
    """One message type as a bag describes it."""

    name: str
    definition: str  # text in the `ros2msg` schema encoding
    hash: str  # RIHS01


@functools.cache
def type_store() -> Typestore:
    """Every message type of Jazzy."""
    return get_typestore(Stores.ROS2_JAZZY)


@functools.cache
def message_type(name: str) -> MessageType:
    """Describe a message type such as `nav_msgs/msg/Odometry`.

    Raises:
        BagError: Jazzy has no such type.
    """
    store = type_store()
    if name not in store.fielddefs:
        raise BagError(f"message type '{name}' is not one of Jazzy's. Record only types that Jazzy has.")
    return MessageType(name, store.generate_msgdef(name, ros_version=2)[0], store.hash_rihs01(name))


def offered_qos(delivery: Delivery) -> list[dict[str, Any]]:
    """Quality of service of a wire's publishers, as rosbag2 version 9 writes it."""
    return [
        {
            "history": "keep_last",
            "depth": 1 if delivery == "latched" else 10,
            "reliability": "best_effort" if delivery == "best_effort" else "reliable",
            "durability": "transient_local" if delivery == "latched" else "volatile",
            "deadline": _FOREVER,
            "lifespan": _FOREVER,
            "liveliness": "automatic",
            "liveliness_lease_duration": _FOREVER,
            "avoid_ros_namespace_conventions": False,
        }
    ]


ENCAPSULATION = 4  # bytes before the message; the second says the byte order
LITTLE_ENDIAN = 1
PADDING = 3  # bytes at most behind a message
BASE_BYTES = {
    **dict.fromkeys(("bool", "byte", "char", "octet", "int8", "uint8"), 1),
    **dict.fromkeys(("int16", "uint16"), 2),
    **dict.fromkeys(("int32", "uint32", "float32"), 4),
    **dict.fromkeys(("int64", "uint64", "float64"), 8),
}


def unreadable(kind: str, data: Sequence[bytes]) -> list[int]:
    """Indices of messages in CDR that do not fit their type; none where the type is unknown.

    A message with the texts and lengths of the first one fits if that one does, whatever its numbers.
    """
    if kind not in type_store().fielddefs or not data:
        return []
    walk = _walk_through(kind, data[0])
    if walk and len(data) == 1:
        return []
    alike = _alike(walk, data) if walk else np.zeros(len(data), dtype=bool)
    return [i for i in np.flatnonzero(~alike).tolist() if not _readable(kind, data[i])]


def _readable(kind: str, data: bytes) -> bool:
    if data[1:2] == bytes([LITTLE_ENDIAN]):
        return _walk_through(kind, data) is not None
    try:
        type_store().deserialize_cdr(data, kind)
    except Exception:  # noqa: BLE001 - foreign bytes raise whatever they please
        return False
    return True


def _walk_through(kind: str, data: bytes) -> Walk | None:
    """None where the bytes do not fit the type."""
    try:
        walk = Walk(data)
        walk.message(kind)
    except (struct.error, UnicodeDecodeError):
        return None
    return walk if walk.at <= len(data) <= walk.at + PADDING else None


def _alike(walk: Walk, data: Sequence[bytes]) -> np.ndarray:
    """Which messages have the length, the texts and the counts of the first."""
    same = np.array([len(each) == len(data[0]) for each in data])
    table = np.frombuffer(
        b"".join(each for each, fits in zip(data, same, strict=True) if fits), dtype=np.uint8
    )
    table = table.reshape(-1, len(data[0]))
    fixed = [np.arange(begin, end) for begin, end in [(0, ENCAPSULATION), *walk.fixed]]
    columns = np.concatenate(fixed)
    same[same] = (table[:, columns] == table[0, columns]).all(axis=1)
    return same


MOST_ROOM = 32  # that a serialiser leaves at the end [bytes]


def canonical(data: bytes, kind: str) -> bytes:
    """A serialised message as bytes that are equal for equal messages.

    A serialiser leaves what happens to be in memory between fields, and room at the end. Here the former is zero, and
    there is none of the latter.

    Args:
        data: CDR of one message.
        kind: Its type, such as sensor_msgs/msg/Imu.

    Raises:
        ValueError: The bytes are no such message.
    """
    store = type_store()
    for end in range(len(data), len(data) - MOST_ROOM, -1):
        with contextlib.suppress(SerdeError):  # bytes are left over
            return bytes(store.serialize_cdr(store.deserialize_cdr(data[:end], kind), kind))
    raise ValueError(f"{len(data)} bytes are no {kind}.")


class Walk:
    """Goes through one message and notes where things are.

    Raises:
        struct.error: By each of its steps: the bytes end too early.
        UnicodeDecodeError: A text is none.
    """

    def __init__(self, data: bytes, at: int = ENCAPSULATION) -> None:
        """Begin at an offset; checks the encapsulation."""
        if data[:2] != bytes([0, LITTLE_ENDIAN]):
            raise struct.error("another byte order")
        self._data, self.at = data, at
        self.fixed: list[tuple[int, int]] = []  # parts that make the layout, begin and end

    def message(self, kind: str) -> None:
        """Go through everything that a type has."""
        for _, node in type_store().fielddefs[kind][1]:
            self._node(node)

    def _node(self, node: tuple[int, Any]) -> None:
        sort, what = node
        if sort == Nodetype.NAME:
            self.message(what)
        elif sort == Nodetype.BASE:
            self._base(what[0], 1)
        elif sort == Nodetype.ARRAY:
            self._several(*what)
        else:
            self._several(what[0], self.count())

    def _several(self, node: tuple[int, Any], count: int) -> None:
        sort, what = node
        if sort == Nodetype.BASE:
            self._base(what[0], count)
            return
        for _ in range(count):
            self._node(node)

    def _base(self, name: str, count: int) -> None:
        if name in ("string", "wstring"):
            for _ in range(count):
                self.text()
            return
        size = BASE_BYTES[name]
        if count:
            self._skip(self.aligned(size) + size * count - self.at)

    def aligned(self, to: int) -> int:
        """The next offset where a number of so many bytes may begin."""
        return self.at + (ENCAPSULATION - self.at) % to

    def count(self) -> int:
        """How many elements or bytes follow."""
        begin = self.aligned(4)
        (count,) = struct.unpack_from("<I", self._data, begin)
        self.fixed.append((self.at, begin + 4))
        self.at = begin + 4
        return int(count)

    def text(self) -> str:
        """A text."""
        length = self.count()
        begin = self.at
        self._skip(length)
        self.fixed.append((begin, self.at))
        return self._data[begin : self.at].rstrip(b"\0").decode()

    def doubles(self) -> list[int]:
        """Where each number of a sequence is."""
        count = self.count()
        begin = self.aligned(8) if count else self.at
        self._skip(begin + 8 * count - self.at)
        return [begin + 8 * i for i in range(count)]

    def _skip(self, count: int) -> None:
        if self.at + count > len(self._data):
            raise struct.error("torn off")
        self.at += count
