"""Files of a bag, and the records of an MCAP file one after the other, as far as the file goes.

Needs no index and no footer: damage costs the chunk it is in, and a torn end costs the torn piece.
"""

from __future__ import annotations

import io
import os
import struct
import tempfile
import zlib
from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import IO, Any

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, Message, Metadata, Schema
from mcap.stream_reader import get_chunk_data_stream
from mcap.writer import MCAP0_MAGIC

from fulmar_bags.mcap_file import BEGUN
from fulmar_bags.metadata import read_custom, read_information
from fulmar_bags.selection import Selection
from fulmar_bags.stored_bytes import PACKED, WHOLE, FileBytes, Piece, skip, unpack_into, unpacks_to
from fulmar_core.config.errors import BagError

Record = Schema | Channel | Message | Metadata | Attachment

ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"
MOST_RECORD = 100_000_000  # bytes of a message or an attachment
MOST_CHUNK = 1 << 24  # bytes that are looked at in memory
MOST_NAME = 32  # bytes of the name of a compression
INVALID = 0  # opcode that no record has (MCAP specification, "Records")

_HEAD = struct.Struct("<BQ")  # opcode and length of every record
_CHUNK = struct.Struct("<QQQII")  # times, size, checksum and length of the name of the compression
_LENGTH = struct.Struct("<Q")
_CHECKSUM = struct.Struct("<I")  # at the end of an attachment
_MESSAGE = struct.Struct("<HIQQ")  # channel, sequence, log time and publish time, before the content
_READERS: dict[int, Callable[[ReadDataStream, int], Record]] = {
    Opcode.SCHEMA: lambda stream, _: Schema.read(stream),
    Opcode.CHANNEL: lambda stream, _: Channel.read(stream),
    Opcode.MESSAGE: Message.read,
    Opcode.METADATA: lambda stream, _: Metadata.read(stream),
    Opcode.ATTACHMENT: lambda stream, length: _attachment(stream.read(length)),
}


def bag_files(bag: Path) -> list[Path]:
    """The MCAP files of a bag folder, in the order in which they were written, or the one that is given.

    Raises:
        BagError: There is none.
    """
    if bag.is_file():
        return [bag]
    if not bag.is_dir():
        raise BagError(f"{bag}: there is no such bag. Give a bag folder, or the .mcap file in it.")
    named = (*bag.glob("*.mcap"), *bag.glob(f"*.mcap{BEGUN}"))
    files = sorted((path for path in named if path.suffix != BEGUN or path.stat().st_size), key=place_in_bag)
    other = (
        next(iter(sorted(path for path in bag.iterdir() if storage_of(path))), None) if not files else None
    )
    if other is not None:
        more = f'; for more try: sqlite3 "{other}" .recover | sqlite3 recovered.db3'
        raise BagError(
            f"{bag}: holds {other.name}, and only .mcap files are recovered. What is sound of it is read as it is"
            + (more if storage_of(other) == "sqlite3" else ".")
        )
    if not files:
        raise BagError(f"{bag}: 0 .mcap files where a bag folder has one or more. Give a bag folder.")
    return files


def place_in_bag(path: Path) -> tuple[str, int]:
    """Sort key of the files of a bag: `run_10.mcap` comes after `run_9.mcap`."""
    name = plain_name(path).stem
    stem, _, number = name.rpartition("_")
    return (stem, int(number)) if number.isdecimal() else (name, 0)


def plain_name(path: Path) -> Path:
    """A file as it is called when it is neither packed as a whole nor without a name yet."""
    return path.with_name(path.name.removesuffix(PACKED).removesuffix(BEGUN))


@dataclass
class PlacedMessage(Message):
    """A message, and where its content lies: see `McapFile.read`."""

    outer: int
    at: int


def read_records(path: Path, damage: list[str]) -> Iterator[Record]:
    """Schemas, channels, messages, metadata and attachments of an MCAP file, in their order.

    `damage` grows by one line for each part that cannot be read.

    Raises:
        BagError: The file cannot be opened, is empty, or is no MCAP file at all.
    """
    return McapFile(path).records(damage)


class McapFile:
    """An MCAP file, read from front to back and piece by piece; its messages also by their places."""

    def __init__(self, path: Path, selection: Selection | None = None) -> None:
        """Look at a file, of which `selection` may leave topics out.

        Raises:
            BagError: It cannot be opened.
        """
        self.path, self._bytes = path, FileBytes(path)
        self._selection = selection or Selection()
        self._unpacked: tuple[int, bytes] = (WHOLE, b"")  # the chunk that was looked at last
        # Contents of chunks that are too large for memory, in one file without a name, and where each begins there.
        self._spool: IO[bytes] | None = None
        self._spooled: dict[int, int] = {}

    def records(self, damage: list[str]) -> Iterator[Record]:
        """As `read_records`."""
        with self._bytes.opened(damage) as stream:
            magic = stream.read(len(MCAP0_MAGIC))
            if not magic:
                raise BagError(
                    f"{self.path}: the file is empty. Was the recorder stopped before it wrote anything?"
                )
            if magic != MCAP0_MAGIC:
                raise BagError(f"{self.path}: this is no MCAP file.")
            yield from self._region(stream, len(magic), self._bytes.size, WHOLE, damage)

    def read(self, outer: int, at: int, length: int) -> bytes:
        """The content of a message.

        Args:
            outer: Where the record of the chunk is that is packed around it; `WHOLE` where it lies in the file itself.
            at: Where it begins, in the file or in the content of that chunk.
            length: How long it is [bytes].
        """
        if outer == WHOLE:
            return self._bytes.read(WHOLE, at, length)
        if self._spool is not None and outer in self._spooled:
            return os.pread(self._spool.fileno(), length, self._spooled[outer] + at)
        if self._unpacked[0] != outer:
            _, size = _HEAD.unpack(self._bytes.read(WHOLE, outer, _HEAD.size))
            body = self._bytes.read(WHOLE, outer + _HEAD.size, size)
            self._unpacked = (outer, _content(Chunk.read(ReadDataStream(BytesIO(body)))))
        return self._unpacked[1][at : at + length]

    def _region(
        self, stream: IO[bytes], at: int, end: int | None, outer: int, damage: list[str]
    ) -> Iterator[Record]:
        """Records one after the other, of the file or of a large chunk; without an `end` to the end of the stream."""
        name = self.path.name
        while head := stream.read(_HEAD.size if end is None else min(_HEAD.size, end - at)):
            if len(head) < _HEAD.size:
                damage.append(f"{name}: {len(head)} bytes at the end are torn off.")
                return
            opcode, length = _HEAD.unpack(head)
            start, at = at, at + _HEAD.size + length
            where = f"{name}: the record at byte {start}"
            if opcode == Opcode.DATA_END:
                return
            whole = opcode != INVALID and (end is None or at <= end)
            if whole and opcode == Opcode.CHUNK and outer == WHOLE:
                whole = yield from self._chunk(stream, start, length, damage)
            elif whole and opcode not in _READERS:
                skip(stream, length)
            elif whole and length > MOST_RECORD:
                damage.append(f"{where} has {length} bytes and was left out; at most {MOST_RECORD} are read.")
                skip(stream, length)
            elif whole:
                body = stream.read(length)
                whole = len(body) == length
                if whole:
                    yield from _parse(
                        opcode, body, where, damage, (outer, start + _HEAD.size + _MESSAGE.size)
                    )
            if not whole:
                damage.append(f"{where} is torn off or damaged; nothing after it counts.")
                return

    def _chunk(
        self, stream: IO[bytes], start: int, length: int, damage: list[str]
    ) -> Generator[Record, None, bool]:
        """Records of a chunk; returns whether it is there to its end."""
        where = f"{self.path.name}: the record at byte {start}"
        head = stream.read(min(length, _CHUNK.size))
        try:
            begin_ns, end_ns, size, crc, name_length = _CHUNK.unpack(head)
            about = stream.read(min(name_length, MOST_NAME) + _LENGTH.size)
            inner = length - len(head) - len(about)
            if name_length > MOST_NAME or _LENGTH.unpack(about[name_length:])[0] != inner:
                raise ValueError("its lengths differ")
            chunk = Chunk(about[:name_length].decode(), b"", end_ns, begin_ns, crc, size)
        except (struct.error, UnicodeDecodeError, ValueError) as error:
            damage.append(f"{where} is damaged and was left out ({type(error).__name__}).")
            skip(stream, length - len(head) - (len(about) if len(head) == _CHUNK.size else 0))
            return True
        if max(inner, size) > MOST_CHUNK:
            yield from self._large_chunk(stream, chunk, start, inner, damage)
            return True
        chunk.data = stream.read(inner)
        if len(chunk.data) < inner:
            return False
        self._selection.reached(start)
        # What is not packed lies in the file itself, at the end of its record.
        place = (start, 0) if chunk.compression else (WHOLE, start + _HEAD.size + length - inner)
        yield from _parse(Opcode.CHUNK, chunk, where, damage, place, self._selection)
        return True

    def _large_chunk(
        self, stream: IO[bytes], chunk: Chunk, start: int, inner: int, damage: list[str]
    ) -> Iterator[Record]:
        """Records of a chunk that is too large for memory: it is unpacked into a file without a name."""
        content = Piece(stream, inner)
        try:
            if self._spool is None:
                self._spool = tempfile.TemporaryFile()  # noqa: SIM115 - lives as long as its messages are looked at
            spool, begin = self._spool, self._spool.seek(0, os.SEEK_END)
            size = unpack_into(spool, io.BufferedReader(content), chunk, unpacks_to(inner))
        except OSError as error:
            raise BagError(
                f"{self.path}: no room to unpack it in {tempfile.gettempdir()}: {error}."
            ) from error
        except Exception as error:  # noqa: BLE001 - as in `_parse`
            where = f"{self.path.name}: the record at byte {start}"
            damage.append(f"{where} is damaged and was left out ({type(error).__name__}).")
            skip(stream, content.left)
            spool.truncate(begin)
            return
        skip(stream, content.left)
        self._spooled[start] = begin
        spool.seek(begin)
        yield from self._region(spool, 0, size, start, damage)


def unpack(data: bytes) -> bytes:
    """One message that was compressed by itself; as it is where that fails, which is no message then."""
    most = unpacks_to(len(data))
    try:
        plain: bytes = zstandard.ZstdDecompressor().stream_reader(data).read(most + 1)
    except zstandard.ZstdError:
        return data
    return plain if len(plain) <= most else data


def _attachment(body: bytes) -> Attachment:
    """`Attachment.read` with the checksum, which it skips; 0 stands for none."""
    record = Attachment.read(ReadDataStream(BytesIO(body)))
    (checksum,) = _CHECKSUM.unpack(body[-_CHECKSUM.size :])
    if checksum and checksum != zlib.crc32(body[: -_CHECKSUM.size]):
        raise BagError(f"the attached '{record.name}'")
    return record


def _parse(
    opcode: int,
    body: bytes | Chunk,
    where: str,
    damage: list[str],
    place: tuple[int, int],
    selection: Selection | None = None,
) -> list[Any]:
    """The records of one; `place` is that of a message's content, or of the first byte in a chunk."""
    try:
        if isinstance(body, Chunk):
            return _records_of(body, *place, selection or Selection())
        record = _READERS[opcode](ReadDataStream(BytesIO(body)), len(body))
        return (
            [PlacedMessage(**vars(record), outer=place[0], at=place[1])]
            if isinstance(record, Message)
            else [record]
        )
    except BagError as error:
        damage.append(f"{where}, {error}, is damaged and was left out (its checksum differs).")
        return []
    except Exception as error:  # noqa: BLE001 - flipped bits raise whatever they please, from four libraries
        damage.append(f"{where} is damaged and was left out ({type(error).__name__}).")
        return []


def _content(chunk: Chunk) -> bytes:
    if chunk.compression == "zstd":
        said = zstandard.frame_content_size(chunk.data)
        if max(said, chunk.uncompressed_size) > unpacks_to(len(chunk.data)):
            raise ValueError(f"unpacks to {max(said, chunk.uncompressed_size)} bytes.")
    stream, size = get_chunk_data_stream(chunk, validate_crc=True)
    return bytes(stream.read(size))


def _records_of(chunk: Chunk, outer: int, begin: int, selection: Selection) -> list[Any]:
    """What `mcap.stream_reader.breakup_chunk` gives, several times as fast: most of a bag are messages."""
    data = _content(chunk)
    size, skipped = len(data), selection.skipped
    records: list[Any] = []
    offset = 0
    while offset < size:
        opcode, length = _HEAD.unpack_from(data, offset)
        start, offset = offset + _HEAD.size, offset + _HEAD.size + length
        if offset > size or (opcode == Opcode.MESSAGE and length < _MESSAGE.size):
            raise ValueError(f"a record of {length} bytes does not fit.")
        if opcode == Opcode.MESSAGE:
            channel, sequence, log_ns, publish_ns = _MESSAGE.unpack_from(data, start)
            if channel in skipped:
                continue
            at = start + _MESSAGE.size
            records.append(
                PlacedMessage(channel, log_ns, data[at:offset], publish_ns, sequence, outer, begin + at)
            )
        elif opcode in _READERS:
            records.append(_READERS[opcode](ReadDataStream(BytesIO(data[start:offset])), length))
            selection.see(records[-1])
    return records


ENDINGS = {".mcap": "mcap", ".db3": "sqlite3", ".bag": "rosbag1"}
GIVE = "Give a bag folder, the .mcap or .db3 file in it, or a .bag of ROS 1."


def storage_of(file: Path) -> str | None:
    """`mcap`, `sqlite3` or `rosbag1`, also where the file is packed as a whole; None if neither."""
    return ENDINGS.get(plain_name(file).suffix)


def files_of(path: Path) -> tuple[Path, ...]:
    """Files of a bag in the order of their numbers; a bag may be split into several.

    Raises:
        BagError: There is none.
    """
    if path.is_file():
        if storage_of(path) is None:
            raise BagError(f"{path}: this is no bag. {GIVE}")
        return (path,)
    if not path.is_dir():
        raise BagError(f"{path}: there is no such bag. {GIVE}")
    there = [file for file in _there(path) if not _is_there_unpacked(file)]
    for storage in _storages(path):
        files = [file for file in there if storage_of(file) == storage]
        if files:
            return tuple(sorted(files, key=place_in_bag))
    found = ", ".join(sorted(each.name for each in path.iterdir())[:4])
    raise BagError(
        f"{path}: has no .mcap and no .db3 file{f', only {found}' if found else ': it is empty'}. {GIVE}"
    )


def _there(folder: Path) -> list[Path]:
    """Files of a folder that hold something."""
    return [
        file for file in folder.iterdir() if file.is_file() and (file.suffix != BEGUN or file.stat().st_size)
    ]


def _storages(folder: Path) -> list[str]:
    """Storages in the order in which they are looked for: that of `metadata.yaml` first."""
    said = read_information(folder).get("storage_identifier")
    return sorted(ENDINGS.values(), key=lambda storage: storage != said)


def _is_there_unpacked(file: Path) -> bool:
    return file.suffix == PACKED and file.with_name(file.name.removesuffix(PACKED)).is_file()


def left_out_files(path: Path, files: tuple[Path, ...]) -> list[tuple[str, str]]:
    """Names of bag files in a folder that are not among those of the bag, and why."""
    others = sorted(set(_there(path)) - set(files)) if path.is_dir() else []
    return [
        (
            file.name,
            "it is there unpacked, too"
            if _is_there_unpacked(file)
            else f"the folder holds {storage_of(files[0])} and {storage_of(file)}. It can be given by itself",
        )
        for file in others
        if storage_of(file)
    ]


def missing_files(path: Path) -> tuple[str, ...]:
    """Names that `metadata.yaml` lists and that are not in the folder; none where one file alone was given."""
    listed = read_information(path).get("relative_file_paths") if path.is_dir() else None
    there = {plain_name(file).name for file in path.iterdir()} if path.is_dir() else set()
    entries = listed if isinstance(listed, list) else []
    names = [name for name in entries if isinstance(name, str) and Path(name).name]
    return tuple(name for name in names if plain_name(Path(name)).name not in there)


def custom_text(path: Path, entry: str) -> str:
    """A text from `custom_data` in the bag's `metadata.yaml`; empty where it is not there."""
    return read_custom(path if path.is_dir() else path.parent).get(entry, "")
