"""Bytes of the files of a bag, looked at where they lie, so that no bag has to fit into memory.

A camera makes a bag of gigabytes; what an evaluation needs are some megabytes of it. Small messages are kept as they
are read, until they fill their share; all others are read again from their place when they are looked at.
"""

from __future__ import annotations

import io
import os
import zlib
from array import array
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any, Protocol, overload

import lz4.frame
import numpy as np
import zstandard
from mcap.records import Chunk

from fulmar_core.config.bounded_file import ENDLESS, bounded_file
from fulmar_core.config.errors import BagError

PACKED = ".zstd"  # ending of files that rosbag2 compressed as a whole
# Recorded messages shrink to a tenth, and a camera in the dark to a hundredth: beyond this it is a trap.
UNPACK_RATIO, UNPACK_LEAST = 500, 1 << 26
PIECE = 1 << 20  # read at once
WINDOW = 1 << 16  # read at once for a message that lies among others of its topic
KEPT_BYTES = 1 << 26  # of all messages of a bag that stay in memory
KEPT_LENGTH = 1 << 14  # of the longest message that stays there
OVERHEAD = 150  # of a message in memory, beside its content, about
HEAD = 16  # bytes of each message that stay in memory, with the stamp of those that have one
WHOLE = -1  # `outer` of what lies in the file itself, and not in a packed part of it


def unpacks_to(packed: int) -> int:
    """How much so many packed bytes unpack to at most [bytes]."""
    return max(UNPACK_LEAST, UNPACK_RATIO * packed)


class FileBytes:
    """A file by its offsets; one that is packed as a whole by those of its content, which is read forwards only.

    Attributes:
        size: Of the file, None for the unknown size of what is packed [bytes].
    """

    def __init__(self, path: Path) -> None:
        """Look at a file.

        Raises:
            BagError: It cannot be opened.
        """
        self.path, self.is_packed = path, path.suffix == PACKED
        with _bag_errors(path), bounded_file(path, ENDLESS) as file:
            self.on_disk = os.fstat(file.fileno()).st_size
        self.size = None if self.is_packed else self.on_disk
        self._window = (0, b"")
        self._forwards: tuple[int, IO[bytes]] | None = None

    @contextmanager
    def opened(self, damage: list[str]) -> Iterator[IO[bytes]]:
        """The content from its beginning; where it cannot be unpacked it ends, and `damage` grows by a line.

        Raises:
            BagError: It cannot be opened, or unpacks to more than bags do.
        """
        with _bag_errors(self.path), bounded_file(self.path, ENDLESS) as file:
            if not self.is_packed:
                yield file
                return
            yield io.BufferedReader(_Unpacked(file, self.path, self.on_disk, damage), PIECE)

    def read(self, outer: int, at: int, length: int) -> bytes:
        """So many bytes from an offset of the content, fewer where it ends; `outer` is always `WHOLE`."""
        begin, held = self._window
        if begin <= at and at + length <= begin + len(held):
            return held[at - begin : at - begin + length]
        if self.is_packed:
            return self._read_on(at, length)
        with _bag_errors(self.path), bounded_file(self.path, ENDLESS) as file:
            held = os.pread(file.fileno(), max(length, WINDOW), at)
        self._window = (at, held) if length < WINDOW else (0, b"")
        return held[:length]

    def _read_on(self, at: int, length: int) -> bytes:
        if self._forwards is None or self._forwards[0] > at:
            file = self.path.open("rb")
            self._forwards = (0, io.BufferedReader(_Unpacked(file, self.path, self.on_disk, []), PIECE))
        place, stream = self._forwards
        skip(stream, at - place)
        found = stream.read(length)
        self._forwards = (at + len(found), stream)
        return found


class _Unpacked(io.RawIOBase):
    """The content of a packed file, which ends where it cannot be unpacked."""

    def __init__(self, file: IO[bytes], path: Path, on_disk: int, damage: list[str]) -> None:
        super().__init__()
        self._file = file  # closed with this
        self._reader = zstandard.ZstdDecompressor().stream_reader(file, read_across_frames=True)
        self._path, self._damage, self._left, self._most = (
            path,
            damage,
            unpacks_to(on_disk),
            unpacks_to(on_disk),
        )

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: Any) -> int:
        try:
            count = int(self._reader.readinto(buffer))
        except zstandard.ZstdError as error:
            self._damage.append(f"{self._path.name}: the rest cannot be unpacked ({error}).")
            return 0
        self._left -= count
        if self._left < 0:
            raise BagError(
                f"{self._path}: unpacks to more than {self._most} bytes, {UNPACK_RATIO} times its size, which no bag "
                "does. If you trust it, unpack it by `zstd -d`."
            )
        return count


def skip(stream: IO[bytes], count: int) -> None:
    """Leave out so many bytes of a stream that goes forwards only, as far as it goes."""
    while count > 0 and (piece := stream.read(min(count, PIECE))):
        count -= len(piece)


class Piece(io.RawIOBase):
    """So many bytes of a stream that goes forwards only."""

    def __init__(self, stream: IO[bytes], length: int) -> None:
        """Begin where the stream is.

        Attributes:
            left: Bytes that were not read yet.
        """
        super().__init__()
        self._stream, self.left = stream, length

    def readable(self) -> bool:
        """It is."""
        return True

    def readinto(self, buffer: Any) -> int:
        """As of any raw stream."""
        found = self._stream.read(min(len(buffer), self.left))
        buffer[: len(found)] = found
        self.left = self.left - len(found) if found else 0
        return len(found)


def unpack_into(spool: IO[bytes], content: IO[bytes], chunk: Chunk, most: int) -> int:
    """Unpack a chunk of MCAP piece by piece, and check it.

    Args:
        spool: Where its content is written.
        content: As it lies in the file.
        chunk: Its compression and checksum.
        most: So much it may unpack to [bytes].

    Returns:
        How much was written [bytes].

    Raises:
        ValueError: It unpacks to more, its checksum differs, or its compression is not known.
        OSError: There is no room.
    """
    readers: dict[str, Callable[[IO[bytes]], Any]] = {
        "": lambda stream: stream,
        "zstd": lambda stream: zstandard.ZstdDecompressor().stream_reader(stream),
        "lz4": lambda stream: lz4.frame.open(stream),
    }
    if chunk.compression not in readers:
        raise ValueError(f"'{chunk.compression}' is not known")
    reader, size, crc = readers[chunk.compression](content), 0, 0
    while piece := reader.read(PIECE):
        size, crc = size + len(piece), zlib.crc32(piece, crc)
        if size > most:
            raise ValueError(f"unpacks to more than {most} bytes")
        spool.write(piece)
    if size != chunk.uncompressed_size or (chunk.uncompressed_crc and crc != chunk.uncompressed_crc):
        raise ValueError("its checksum differs")
    return size


@contextmanager
def _bag_errors(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise BagError(f"{path}: {error.strerror}.") from error


class Source(Protocol):
    """Where messages lie."""

    def read(self, outer: int, at: int, length: int) -> bytes:
        """One message by its place."""


@dataclass
class Room:
    """How many bytes of the messages of a bag may still stay in memory."""

    left: int = KEPT_BYTES

    def take(self, length: int) -> bool:
        """Whether a message of so many bytes stays."""
        fits = length <= KEPT_LENGTH and length + OVERHEAD <= self.left
        self.left -= length + OVERHEAD if fits else 0
        return fits


class Payloads(Sequence[bytes]):
    """Contents of the messages of one topic, by number."""

    def __init__(self, room: Room) -> None:
        """Begin without a message; `room` is that of the whole bag."""
        self._room = room
        self._sources: list[Source] = []
        self._numbers: dict[int, int] = {}  # of each source, by its identity
        self._of, self._outer, self._at, self._lengths = array("H"), array("q"), array("q"), array("q")
        self._kept: dict[int, bytes] = {}
        self._sizes: dict[int, int] = {}  # of those that are packed by themselves
        self._heads = bytearray()
        self._order: np.ndarray | None = None

    def append(self, data: bytes, source: Source, outer: int, at: int, stored: int) -> None:
        """Add a message.

        Args:
            data: Its content.
            source: Where it lies.
            outer: The first part of its place.
            at: The second part of its place.
            stored: How long it is there, which is not its length where it is packed by itself [bytes].
        """
        number = self._numbers.setdefault(id(source), len(self._sources))
        if number == len(self._sources):
            self._sources.append(source)
        if self._room.take(len(data)):
            self._kept[len(self._at)] = data
        self._of.append(number)
        self._outer.append(outer)
        self._at.append(at)
        self._lengths.append(stored)
        self._heads += data[:HEAD].ljust(HEAD, b"\0")
        if len(data) != stored:
            self._sizes[len(self._at) - 1] = len(data)

    def chosen(self, numbers: Sequence[int] | np.ndarray) -> Payloads:
        """Some of the messages, in the order of their numbers as given; nothing is copied."""
        new = Payloads(self._room)
        vars(new).update(vars(self))
        picked = np.asarray(numbers, dtype=np.int64)
        new._order = picked if self._order is None else self._order[picked]
        return new

    @property
    def lengths(self) -> np.ndarray:
        """Bytes of each message, shape (n,)."""
        found = np.array(self._lengths, dtype=np.int64)
        if self._sizes:
            found[list(self._sizes)] = list(self._sizes.values())
        return found if self._order is None else found[self._order]

    @property
    def heads(self) -> np.ndarray:
        """The first bytes of each message, with zeros behind what is shorter, shape (n, HEAD)."""
        found = np.frombuffer(bytes(self._heads), dtype=np.uint8).reshape(-1, HEAD)
        return found if self._order is None else found[self._order]

    def __len__(self) -> int:
        """Number of messages."""
        return len(self._at) if self._order is None else len(self._order)

    @overload
    def __getitem__(self, index: int) -> bytes: ...
    @overload
    def __getitem__(self, index: slice) -> list[bytes]: ...
    def __getitem__(self, index: int | slice) -> bytes | list[bytes]:
        """One message, or several."""
        if isinstance(index, slice):
            return [self[i] for i in range(*index.indices(len(self)))]
        if not -len(self) <= index < len(self):
            raise IndexError(index)
        place = index % len(self) if self._order is None else int(self._order[index])
        kept = self._kept.get(place)
        if kept is not None:
            return kept
        source = self._sources[self._of[place]]
        return source.read(self._outer[place], self._at[place], self._lengths[place])

    def __eq__(self, other: object) -> bool:
        """As of any other sequence."""
        if not isinstance(other, Sequence) or len(self) != len(other):
            return False
        return all(a == b for a, b in zip(self, other, strict=True))

    __hash__ = None  # type: ignore[assignment]


def lengths_of(data: Sequence[bytes]) -> np.ndarray:
    """Bytes of each message, shape (n,)."""
    return (
        data.lengths if isinstance(data, Payloads) else np.array([len(each) for each in data], dtype=np.int64)
    )


def heads_of(data: Sequence[bytes]) -> np.ndarray:
    """First bytes of each message, with zeros behind what is shorter, shape (n, HEAD)."""
    if isinstance(data, Payloads):
        return data.heads
    return np.frombuffer(b"".join(each[:HEAD].ljust(HEAD, b"\0") for each in data), dtype=np.uint8).reshape(
        -1, HEAD
    )


def picked(data: Sequence[Any], numbers: Sequence[int] | np.ndarray) -> Sequence[Any]:
    """Some entries of a sequence, in the order of their numbers as given."""
    return data.chosen(numbers) if isinstance(data, Payloads) else [data[i] for i in numbers]


def blocks(data: Sequence[bytes], size: int = 8 * PIECE) -> Iterator[tuple[int, list[bytes]]]:
    """Messages in their order, some at once: number of the first, and contents of together about so many bytes."""
    some, length, first = list[bytes](), 0, 0
    for index, each in enumerate(data):
        if some and length + len(each) > size:
            yield first, some
            some, length, first = [], 0, index
        some.append(each)
        length += len(each)
    if some:
        yield first, some
