"""Messages of a bag in sqlite3, as far as the file is sound, with what only its write-ahead log has.

The file is opened so that nothing in its folder changes, and nothing is locked. Schema: rosbag2_storage_sqlite3 of ROS.
"""

from __future__ import annotations

import shutil
import sqlite3
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any
from urllib.parse import quote

from mcap.records import Channel, Schema

from fulmar_bags.mcap_records import PlacedMessage, plain_name
from fulmar_bags.stored_bytes import PIECE, WHOLE, FileBytes
from fulmar_core.config.errors import BagError

LOG, JOURNAL = "-wal", "-journal"  # files of sqlite3 beside its database
PAGE_SIZE_AT, LEAST_PAGE, MOST_PAGE = 16, 512, 1 << 16  # bytes: https://sqlite.org/fileformat.html
LOG_HEAD, FRAME_HEAD = 32, 24  # bytes of a log, and of each of its pages
FARTHEST = 1 << 40  # numbers of messages beyond a damaged part that are tried
MOST_PARTS = 3  # that are named
RECOVER = 'for what may be left of them try: sqlite3 "{0}" .recover | sqlite3 recovered.db3'


class SqliteFile:
    """A .db3 file; its messages also by their numbers."""

    def __init__(self, path: Path, damage: list[str]) -> None:
        """Open a file; what is odd about it becomes a line of `damage`.

        Raises:
            BagError: It cannot be opened.
        """
        self.path = path
        content = FileBytes(path)
        if content.is_packed or _torn_page(path, content.on_disk):
            self._folder = tempfile.TemporaryDirectory()  # goes with this
            path = Path(self._folder.name) / plain_name(path).name
            with content.opened(damage) as stream:
                self._copy(stream, path)
        self._database = self._connected(path)
        if _is_filled(path.with_name(path.name + JOURNAL)):
            damage.append(
                f"{path.name}: its recorder was killed while it wrote; the last messages may be damaged."
            )

    def _copy(self, content: IO[bytes], path: Path) -> None:
        """Write the whole pages of the database to `path`, and its log and journal beside it."""
        try:
            with path.open("wb") as plain:
                shutil.copyfileobj(content, plain, PIECE)
                # A page that is there in part would be read with zeros in the place of the rest.
                plain.truncate(plain.tell() - _torn_page(path, plain.tell()))
            for ending in (LOG, JOURNAL):
                beside = self.path.with_name(path.name + ending)
                if _is_filled(beside):
                    shutil.copyfile(beside, path.with_name(beside.name))
        except OSError as error:
            raise BagError(f"{self.path}: no room for a copy in {path.parent}: {error.strerror}.") from error

    def records(self, damage: list[str]) -> Iterator[Any]:
        """A schema and a channel for each topic, then all messages; `damage` grows as in `read_records`.

        Raises:
            BagError: Nothing can be read.
        """
        try:
            topics = self._database.execute(
                "SELECT id, name, type, serialization_format FROM topics"
            ).fetchall()
            self._database.execute("SELECT id FROM messages NOT INDEXED LIMIT 0")
        except sqlite3.Error as error:
            raise BagError(
                f"{self.path}: this sqlite3 bag cannot be read: {error}; {RECOVER.format(self.path)}."
            ) from error
        for number, name, kind, encoding in topics:
            yield Schema(id=number, name=str(kind), encoding="", data=b"")
            yield Channel(
                id=number, topic=str(name), message_encoding=str(encoding), metadata={}, schema_id=number
            )
        yield from self._messages(damage)

    def read(self, _outer: int, at: int, _length: int) -> bytes:
        """The content of a message by its number."""
        ((data,),) = self._database.execute("SELECT data FROM messages WHERE id = ?", (at,)).fetchall()
        return _bytes(data)

    def _messages(self, damage: list[str]) -> Iterator[PlacedMessage]:
        """By number; behind a part that cannot be read, it goes on with the next message that can."""
        query = "SELECT id, topic_id, timestamp, data FROM messages NOT INDEXED WHERE id >= ? ORDER BY id"
        last, alone, why, lost = 0, False, "", list[str]()
        while True:
            single = False
            try:
                # Python looks one row ahead: alone, the last sound one comes before the error of the next.
                for row in self._database.execute(f"{query} LIMIT 1" if alone else query, (last + 1,)):
                    last = row[0]
                    if isinstance(row[1], int) and isinstance(row[2], int):
                        yield PlacedMessage(row[1], row[2], _bytes(row[3]), 0, 0, WHOLE, last)
                    single = True
                if not alone:
                    break
                if not single:  # where one was found missing, nothing follows
                    lost.append(f"{last + 1} and all after it")
                    break
                alone = False
            except sqlite3.Error as error:
                why = str(error)
                if alone:
                    following = self._next_readable(last)
                    lost.append(
                        f"{last + 1} to {following - 1}" if following else f"{last + 1} and all after it"
                    )
                    why = str(error)
                    if not following:
                        break
                    last = following - 1
                alone = True
        if lost:
            more = len(lost) - MOST_PARTS
            parts = ", ".join(lost[:MOST_PARTS]) + (f" and {more} more parts" if more > 0 else "")
            damage.append(
                f"{self.path.name}: damaged ({why}), messages {parts} are lost; {RECOVER.format(self.path)}."
            )

    def _next_readable(self, last: int) -> int:
        """Number of the first message behind a damaged part; 0 where there is none."""

        def found(number: int) -> int:
            try:
                rows = self._database.execute(
                    "SELECT id, data FROM messages NOT INDEXED WHERE id >= ? ORDER BY id LIMIT 1", (number,)
                ).fetchall()
            except sqlite3.Error:
                return 0
            return int(rows[0][0]) if rows else -1

        low, step = last, 1
        while (far := found(low + step)) == 0:
            low, step = low + step, 2 * step
            if step > FARTHEST:
                return 0
        high = low + step
        while high - low > 1:  # `low` cannot be read, `high` can
            middle = (low + high) // 2
            if (there := found(middle)) == 0:
                low = middle
            else:
                high, far = middle, there
        return max(far, 0)

    def _connected(self, path: Path) -> sqlite3.Connection:
        # With a log, sqlite3 would make a file of shared memory beside it, unless it has the database for itself; and
        # a database that is never written needs neither that nor a lock. A log without a transaction it would delete.
        with_log = _has_commit(path.with_name(path.name + LOG))
        way = "mode=ro&vfs=unix-none" if with_log else "immutable=1"
        try:
            database = sqlite3.connect(f"file:{quote(str(path))}?{way}", uri=True, check_same_thread=False)
            if with_log:
                database.execute("PRAGMA locking_mode = EXCLUSIVE").fetchall()
            database.execute("PRAGMA writable_schema = ON")  # else a file that is torn is not opened at all
        except sqlite3.Error as error:
            raise BagError(f"{self.path}: this sqlite3 bag cannot be read: {error}.") from error
        return database


def _bytes(data: object) -> bytes:
    return data if isinstance(data, bytes) else str(data).encode()


def _torn_page(path: Path, size: int) -> int:
    """How many bytes there are behind the last whole page of a database."""
    with path.open("rb") as file:
        head = file.read(PAGE_SIZE_AT + 2)[PAGE_SIZE_AT:]
    page = int.from_bytes(head, "big")
    page = 1 << 16 if page == 1 else page
    return size % page if page >= LEAST_PAGE else 0


def _has_commit(log: Path) -> bool:
    """Whether a write-ahead log holds a whole transaction (https://sqlite.org/fileformat.html, "WAL Format")."""
    if not _is_filled(log):
        return False
    try:
        with log.open("rb") as file:
            head = file.read(LOG_HEAD)
            page = int.from_bytes(head[8:12], "big")
            length = FRAME_HEAD + page if LEAST_PAGE <= page <= MOST_PAGE else 0
            while length and len(frame := file.read(length)) == length and frame[8:16] == head[16:24]:
                if any(frame[4:8]):
                    return True
    except OSError:  # sqlite3 says what it is
        return True
    return False


def _is_filled(path: Path) -> bool:
    return path.is_file() and path.stat().st_size > 0
