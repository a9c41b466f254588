"""A file that grows by whole pieces and is a complete MCAP file after each of them.

MCAP readers want a footer at the end. This file carries a provisional one (without an index) that every new
piece overwrites in the same write, so that neither SIGKILL nor a full disk leaves a file that readers refuse.
"""

from __future__ import annotations

import errno
import os
from pathlib import Path
from typing import IO, Any, cast

from mcap.data_stream import RecordBuilder
from mcap.records import DataEnd, Footer
from mcap.writer import MCAP0_MAGIC, Writer

from fulmar_core.atomic_write import sync_folder


def _provisional_end() -> bytes:
    builder = RecordBuilder()
    DataEnd(data_section_crc=0).write(builder)
    Footer(summary_start=0, summary_offset_start=0, summary_crc=0).write(builder)
    return builder.end() + MCAP0_MAGIC


PROVISIONAL_END = _provisional_end()
BEGUN = ".begun"  # ending of a file without content; a power cut may leave it to one with content


def mcap_writer(file: BagFile, **options: Any) -> Writer:
    """A writer with the options of `mcap.writer.Writer`, which asks its stream for no more than this file has."""
    return Writer(cast(IO[Any], file), **options)


class BagFile:
    """What `mcap_writer` writes to; bytes wait in memory until `flush`.

    It has its name from the first flush on: nobody finds a file that readers refuse because nothing is in it yet.
    """

    def __init__(self, path: Path) -> None:
        """Create the file, under the name that it has until it holds something.

        Args:
            path: Must not exist yet.

        Raises:
            OSError: It exists, or cannot be created.
        """
        if path.exists():
            raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(path))
        self._path, self._nameless = path, path.with_name(path.name + BEGUN)
        self._descriptor = os.open(self._nameless, os.O_CREAT | os.O_EXCL | os.O_WRONLY | os.O_CLOEXEC, 0o644)
        self._waiting = bytearray()
        self._named = False
        self._on_disk = 0  # bytes, without the provisional end

    @property
    def waiting(self) -> int:
        """Bytes that are not on disk yet."""
        return len(self._waiting)

    @property
    def size(self) -> int:
        """Bytes on disk, without the provisional end."""
        return self._on_disk

    def tell(self) -> int:
        """Where the next byte will go."""
        return self._on_disk + len(self._waiting)

    def write(self, data: bytes) -> int:
        """Keep bytes for the next `flush`."""
        self._waiting += data
        return len(data)

    def flush(self) -> None:
        """Bring what waits to the disk, followed by the provisional end.

        Raises:
            OSError: The disk refuses. The file then ends as before, and the bytes go on waiting.
        """
        self._append(PROVISIONAL_END)

    def finish(self) -> None:
        """Bring what waits, which ends with a footer of its own, to the disk.

        Raises:
            OSError: As `flush`.
        """
        self._append(b"")

    def close(self) -> None:
        """Let go of the file; what waits is lost, and so is a file that never got a name."""
        os.close(self._descriptor)
        if not self._named:
            self._nameless.unlink(missing_ok=True)

    def discard(self) -> None:
        """Let go of the file and remove it."""
        self.close()
        self._path.unlink(missing_ok=True)

    def _append(self, end: bytes) -> None:
        try:
            self._write_at(self._on_disk, bytes(self._waiting) + end)
            os.ftruncate(self._descriptor, self._on_disk + len(self._waiting) + len(end))
            os.fdatasync(self._descriptor)
        except OSError:
            os.ftruncate(self._descriptor, self._on_disk)
            self._write_at(self._on_disk, PROVISIONAL_END)
            raise
        if not self._named:
            os.rename(self._nameless, self._path)
            self._named = True
            sync_folder(self._path.parent)
        self._on_disk += len(self._waiting)
        self._waiting.clear()

    def _write_at(self, offset: int, data: bytes) -> None:
        while data:
            written = os.pwrite(self._descriptor, data, offset)
            offset, data = offset + written, data[written:]
