"""Messages of a ROS 1 bag, format 2.0, from front to back: without its index, so that a torn one is read too.

Source: http://wiki.ros.org/Bags/Format/2.0. Contents are given as ROS 2 writes them.
"""

from __future__ import annotations

import bz2
import io
import struct
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import IO, Any

from mcap.records import Channel, Schema
from rosbags.serde import SerdeError

from fulmar_bags.mcap_records import MOST_RECORD, PlacedMessage
from fulmar_bags.message_types import type_store
from fulmar_bags.stored_bytes import WHOLE, FileBytes, skip, unpacks_to
from fulmar_core.config.errors import BagError

MAGIC = b"#ROSBAG V2.0\n"
MESSAGE, CHUNK, CONNECTION = 2, 5, 7  # operations
MOST_HEADER = 1 << 20  # bytes
NS = 1_000_000_000
_LENGTH, _TIME = struct.Struct("<I"), struct.Struct("<II")


class Ros1File:
    """A .bag file; its messages also by their places."""

    def __init__(self, path: Path) -> None:
        """Look at a file.

        Raises:
            BagError: It cannot be opened.
        """
        self.path, self._bytes = path, FileBytes(path)
        self._unpacked: tuple[int, bytes] = (WHOLE, b"")

    def read(self, outer: int, at: int, length: int) -> bytes:
        """The content of a message, as it lies in the bag."""
        if outer == WHOLE:
            return self._bytes.read(WHOLE, at, length)
        if self._unpacked[0] != outer:
            with self._bytes.opened([]) as stream:
                stream.seek(outer)
                header, data = _record(stream)
            self._unpacked = (outer, _content(header, data))
        return self._unpacked[1][at : at + length]

    def records(self, damage: list[str]) -> Iterator[Any]:
        """Schemas, channels and messages; `damage` grows as in `read_records`.

        Raises:
            BagError: It is no bag of ROS 1.
        """
        with self._bytes.opened(damage) as stream:
            if stream.read(len(MAGIC)) != MAGIC:
                raise BagError(f"{self.path}: this is no bag of ROS 1, format 2.0.")
            known: set[int] = set()
            start = len(MAGIC)
            try:
                while start < self._bytes.on_disk:
                    header, data = _record(stream)
                    end = stream.tell()
                    try:
                        yield from self._records(header, data, start, end - len(data), known, damage)
                    except _DAMAGES as error:
                        if end >= self._bytes.on_disk:
                            raise
                        where = f"{self.path.name}: the record at byte {start}"
                        damage.append(f"{where} is damaged and was left out ({type(error).__name__}).")
                    start = end
            except _DAMAGES:
                where = f"{self.path.name}: the record at byte {start}"
                damage.append(f"{where} is torn off or damaged; nothing after it counts.")

    def _records(
        self, header: dict[str, bytes], data: bytes, start: int, at: int, known: set[int], damage: list[str]
    ) -> Iterator[Any]:
        operation = header["op"][0]
        if operation != CHUNK:
            yield from _single(header, data, (WHOLE, at), known)
            return
        content = _content(header, data)
        packed = header["compression"] != b"none"
        inside = io.BytesIO(content)
        while inside.tell() < len(content):
            its_header, its_data = _record(inside)
            begin = inside.tell() - len(its_data)
            yield from _single(its_header, its_data, (start, begin) if packed else (WHOLE, at + begin), known)


_DAMAGES = (struct.error, ValueError, KeyError, OSError, EOFError, RuntimeError, IndexError)


def _single(header: dict[str, bytes], data: bytes, place: tuple[int, int], known: set[int]) -> Iterator[Any]:
    operation = header["op"][0]
    if operation == CONNECTION:
        (number,) = _LENGTH.unpack(header["conn"])
        if number not in known:
            known.add(number)
            fields = _fields(data)
            kind = type_of(fields["type"].decode())
            yield Schema(
                id=number + 1, name=kind, encoding="ros1msg", data=fields.get("message_definition", b"")
            )
            yield Channel(
                id=number,
                topic=header["topic"].decode(),
                message_encoding="ros1",
                metadata={},
                schema_id=number + 1,
            )
    elif operation == MESSAGE:
        (number,) = _LENGTH.unpack(header["conn"])
        seconds, rest = _TIME.unpack(header["time"])
        yield PlacedMessage(number, seconds * NS + rest, data, 0, 0, *place)


def type_of(name: str) -> str:
    """The name of a type as ROS 2 has it: `nav_msgs/Odometry` is `nav_msgs/msg/Odometry`."""
    package, _, rest = name.partition("/")
    return f"{package}/msg/{rest}" if rest and "/" not in rest else name


def converter(kind: str) -> Callable[[bytes], bytes]:
    """What makes CDR of a message of ROS 1: nothing of one that is not of its type; an unknown type stays as it is."""
    store = type_store()  # its headers have no `seq`, which is left out on the way

    def converted(data: bytes) -> bytes:
        if kind not in store.fielddefs:
            return data
        try:
            return bytes(store.ros1_to_cdr(data, kind))
        except (SerdeError, struct.error, ValueError, IndexError, AssertionError):
            return b""

    return converted


def _record(stream: IO[bytes]) -> tuple[dict[str, bytes], bytes]:
    """Header and content of the next record.

    Raises:
        ValueError: It is torn off, or damaged.
    """
    (length,) = _LENGTH.unpack(stream.read(_LENGTH.size))
    if length > MOST_HEADER:
        raise ValueError("a header is never so long")
    header = _fields(stream.read(length))
    (length,) = _LENGTH.unpack(stream.read(_LENGTH.size))
    if length > MOST_RECORD:
        skip(stream, length)
        raise ValueError("a record is never so long")
    data = stream.read(length)
    if len(data) < length and header.get("compression") != b"none":
        raise ValueError("torn off")
    return header, data


def _fields(data: bytes) -> dict[str, bytes]:
    """Fields of a header by name."""
    found, at = {}, 0
    while at < len(data):
        (length,) = _LENGTH.unpack_from(data, at)
        name, equals, value = data[at + _LENGTH.size : at + _LENGTH.size + length].partition(b"=")
        if not equals:
            raise ValueError("a field has no value")
        found[name.decode()] = value
        at += _LENGTH.size + length
    return found


def _content(header: dict[str, bytes], data: bytes) -> bytes:
    """Content of a chunk.

    Raises:
        ValueError: It is not what its header says.
    """
    import lz4.frame

    (size,) = _LENGTH.unpack(header["size"])
    if size > unpacks_to(len(data)) or size > MOST_RECORD:
        raise ValueError("unpacks to more than bags do")
    way = header["compression"].decode()
    content = {
        "none": lambda: data,
        "bz2": lambda: bz2.BZ2Decompressor().decompress(data, size + 1),
        "lz4": lambda: lz4.frame.LZ4FrameDecompressor().decompress(data, size + 1),
    }[way]()
    if len(content) != size and way != "none":  # what is not packed is read as far as it goes
        raise ValueError("its size differs")
    return bytes(content)
