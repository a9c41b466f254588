"""Files of a bag, and the records of an MCAP file one after the other, as far as the file goes.

Needs no index and no footer: damage costs the chunk it is in, and a torn end costs the torn piece.
"""

from __future__ import annotations

import mmap
import os
import struct
import zlib
from collections.abc import Callable, Iterator
from io import BytesIO
from pathlib import Path
from typing import Any, BinaryIO

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, Message, Metadata, Schema
from mcap.stream_reader import get_chunk_data_stream
from mcap.writer import MCAP0_MAGIC

from fulmar_bags.mcap_file import BEGUN
from fulmar_bags.metadata import read_custom, read_information
from fulmar_core.config.bounded_file import ENDLESS, bounded_file
from fulmar_core.config.errors import BagError

Record = Schema | Channel | Message | Metadata | Attachment

PACKED = ".zstd"  # ending of files that rosbag2 compressed as a whole
ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"
UNPACK_BYTES = 1 << 20  # at once
# Recorded messages shrink to a tenth, and a camera in the dark to a hundredth: beyond this it is a trap.
UNPACK_RATIO, UNPACK_LEAST = 500, 1 << 26
INVALID = 0  # opcode that no record has (MCAP specification, "Records")

_HEAD = struct.Struct("<BQ")  # opcode and length of every record
_CHECKSUM = struct.Struct("<I")  # at the end of an attachment
_MESSAGE = struct.Struct("<HIQQ")  # channel, sequence, log time and publish time, before the content
_READERS: dict[int, Callable[[ReadDataStream, int], Record | Chunk]] = {
    Opcode.SCHEMA: lambda stream, _: Schema.read(stream),
    Opcode.CHANNEL: lambda stream, _: Channel.read(stream),
    Opcode.MESSAGE: Message.read,
    Opcode.METADATA: lambda stream, _: Metadata.read(stream),
    Opcode.ATTACHMENT: lambda stream, length: _attachment(stream.read(length)),
    Opcode.CHUNK: lambda stream, _: Chunk.read(stream),
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


def read_records(path: Path, damage: list[str]) -> Iterator[Record]:
    """Schemas, channels, messages, metadata and attachments of an MCAP file, in their order.

    `damage` grows by one line for each part that cannot be read.

    Raises:
        BagError: The file cannot be opened, is empty, or is no MCAP file at all.
    """
    data = memoryview(file_bytes(path, damage))
    if not data:
        raise BagError(f"{path}: the file is empty. Was the recorder stopped before it wrote anything?")
    if bytes(data[: len(MCAP0_MAGIC)]) != MCAP0_MAGIC:
        raise BagError(f"{path}: this is no MCAP file.")
    offset = len(MCAP0_MAGIC)
    while offset < len(data):
        if len(data) - offset < _HEAD.size:
            damage.append(f"{path.name}: {len(data) - offset} bytes at the end are torn off.")
            return
        opcode, length = _HEAD.unpack_from(data, offset)
        start, offset = offset, offset + _HEAD.size + length
        if opcode == Opcode.DATA_END:
            return
        if offset > len(data) or opcode == INVALID:
            damage.append(
                f"{path.name}: the record at byte {start} is torn off or damaged; nothing after it counts."
            )
            return
        if opcode in _READERS:
            body = bytes(data[start + _HEAD.size : offset])
            yield from _parse(opcode, body, f"{path.name}: the record at byte {start}", damage)


def file_bytes(path: Path, damage: list[str]) -> bytes | mmap.mmap:
    """Bytes of a file, unpacked if it is packed as a whole; `damage` grows by a line where that fails on the way.

    What is not packed stays on the disk until it is looked at.

    Raises:
        BagError: It cannot be opened, or unpacks to more than bags do.
    """
    try:
        with bounded_file(path, ENDLESS) as file:
            if path.suffix == PACKED:
                return _unpacked(file, path, damage)
            size = os.fstat(file.fileno()).st_size
            return mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) if size else b""
    except OSError as error:
        raise BagError(f"{path}: {error.strerror}.") from error


def _unpacked(file: BinaryIO, path: Path, damage: list[str]) -> bytes:
    """The content of a file that is packed as a whole, as far as bags unpack."""
    most = unpacks_to(os.fstat(file.fileno()).st_size)
    pieces, length = list[bytes](), 0
    reader = zstandard.ZstdDecompressor().stream_reader(file, read_across_frames=True)
    try:
        while piece := reader.read(UNPACK_BYTES):
            length += len(piece)
            if length > most:
                raise BagError(
                    f"{path}: unpacks to more than {most} bytes, {UNPACK_RATIO} times its size, which no bag does. "
                    "If you trust it, unpack it by `zstd -d`."
                )
            pieces.append(piece)
    except zstandard.ZstdError as error:
        damage.append(f"{path.name}: the rest cannot be unpacked ({error}).")
    return b"".join(pieces)


def unpacks_to(packed: int) -> int:
    """How much so many packed bytes unpack to at most [bytes]."""
    return max(UNPACK_LEAST, UNPACK_RATIO * packed)


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


def _parse(opcode: int, body: bytes, where: str, damage: list[str]) -> list[Any]:
    try:
        record = _READERS[opcode](ReadDataStream(BytesIO(body)), len(body))
        return _records_of(record) if isinstance(record, Chunk) else [record]
    except BagError as error:
        damage.append(f"{where}, {error}, is damaged and was left out (its checksum differs).")
        return []
    except Exception as error:  # noqa: BLE001 - flipped bits raise whatever they please, from four libraries
        damage.append(f"{where} is damaged and was left out ({type(error).__name__}).")
        return []


def _records_of(chunk: Chunk) -> list[Any]:
    """What `mcap.stream_reader.breakup_chunk` gives, several times as fast: most of a bag are messages."""
    if chunk.compression == "zstd":
        said = zstandard.frame_content_size(chunk.data)
        if max(said, chunk.uncompressed_size) > unpacks_to(len(chunk.data)):
            raise ValueError(f"unpacks to {max(said, chunk.uncompressed_size)} bytes.")
    stream, size = get_chunk_data_stream(chunk, validate_crc=True)
    data = stream.read(size)
    records: list[Any] = []
    offset = 0
    while offset < size:
        opcode, length = _HEAD.unpack_from(data, offset)
        start, offset = offset + _HEAD.size, offset + _HEAD.size + length
        if offset > size or (opcode == Opcode.MESSAGE and length < _MESSAGE.size):
            raise ValueError(f"a record of {length} bytes does not fit.")
        if opcode == Opcode.MESSAGE:
            channel, sequence, log_ns, publish_ns = _MESSAGE.unpack_from(data, start)
            content = data[start + _MESSAGE.size : offset]
            records.append(Message(channel, log_ns, content, publish_ns, sequence))
        elif opcode in _READERS:
            records.append(_READERS[opcode](ReadDataStream(BytesIO(data[start:offset])), length))
    return records


ENDINGS = {".mcap": "mcap", ".db3": "sqlite3"}
GIVE = "Give a bag folder, or the .mcap or .db3 file in it."


def storage_of(file: Path) -> str | None:
    """`mcap` or `sqlite3`, also where the file is packed as a whole; None if neither."""
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
    there = [
        file for file in path.iterdir() if file.is_file() and (file.suffix != BEGUN or file.stat().st_size)
    ]
    for storage in ENDINGS.values():
        files = [file for file in there if storage_of(file) == storage]
        if files:
            return tuple(sorted(files, key=place_in_bag))
    found = ", ".join(sorted(each.name for each in path.iterdir())[:4])
    raise BagError(
        f"{path}: has no .mcap and no .db3 file{f', only {found}' if found else ': it is empty'}. {GIVE}"
    )


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
