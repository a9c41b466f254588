"""A bag as rows of plain numbers and texts, and as CSV and NumPy files of them."""

from __future__ import annotations

import csv
import itertools
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from fulmar_bags.column_store import ColumnStore
from fulmar_bags.contents import Bag
from fulmar_bags.decode import has_header, stamp_of, timed_messages
from fulmar_bags.frame_messages import FRAME_TYPES
from fulmar_bags.gathered import Topic
from fulmar_core.config.errors import BagError

MOST_ENTRIES = 64  # of one array in columns of their own; what is longer stays together
Row = dict[str, Any]  # numbers, texts, and arrays of what is longer


def rows(topic: Topic) -> tuple[list[int], list[int], list[Row]]:
    """Every message that can be read.

    Returns:
        Times of recording [ns], stamps [ns] (equal to the former where there are none), and fields by path.
    """
    found = list(rows_of(topic))
    return [log for log, _, _ in found], [stamp for _, stamp, _ in found], [row for _, _, row in found]


def rows_of(topic: Topic) -> Iterator[tuple[int, int, Row]]:
    """The same, message by message: time of recording, stamp and fields of each."""
    stamped = has_header(topic.type)
    for log, _, message in timed_messages(topic):
        yield log, stamp_of(message) if stamped else log, dict(_fields(message, ""))


def _fields(value: Any, path: str) -> Iterator[tuple[str, Any]]:
    if isinstance(value, str | bool | int | float | np.number):
        yield path, value.item() if isinstance(value, np.number) else value
        return
    if isinstance(value, np.ndarray | list | tuple):
        if len(value) > MOST_ENTRIES:
            yield from _long(value, path)
            return
        for index, entry in enumerate(value):
            yield from _fields(entry, f"{path}[{index}]")
        return
    for name in getattr(value, "__dataclass_fields__", ()):
        if not name.startswith("__"):
            yield from _fields(getattr(value, name), f"{path}.{name}" if path else name)


def _long(entries: Any, path: str) -> Iterator[tuple[str, Any]]:
    """A long array as it is; of a long list of messages, one array for each of their fields."""
    if isinstance(entries, np.ndarray):
        yield path, entries
        return
    together: dict[str, list[Any]] = {}
    for entry in entries:
        for name, value in _fields(entry, f"{path}[*]"):
            together.setdefault(name, []).append(np.atleast_1d(value))
    for name, values in together.items():
        yield name, np.concatenate(values)


def columns(found: list[Row]) -> list[str]:
    """Paths of all rows together, in the order in which they first come."""
    return list(dict.fromkeys(path for row in found for path in row))


TIMES = ("log_ns", "stamp_ns")


def write_csv(bag: Bag, folder: Path) -> tuple[list[Path], list[str]]:
    """Write one table for each topic that has messages, into a folder that is made.

    Columns are the time of recording and the stamp [ns], then every field by its path.

    Returns:
        The files, and what they lack, in words.

    Raises:
        BagError: The bag has no messages.
        OSError: The folder cannot be written.
    """
    topics = _full(bag)
    folder.mkdir(parents=True, exist_ok=True)
    left_out: list[str] = []
    return [_write_table(topic, folder / f"{_file_name(topic)}.csv", left_out) for topic in topics], left_out


def _write_table(topic: Topic, path: Path, left_out: list[str]) -> Path:
    names, long = _columns_of(itertools.islice(rows_of(topic), 1))
    count = _filled(topic, path, names, long)
    if count is None:  # not all messages have the fields of the first
        names, long = _columns_of(rows_of(topic))
        count = _filled(topic, path, names, long)
    if long:
        better = "frames" if topic.type in FRAME_TYPES else "npz"
        left_out.append(f"{topic.name}: {', '.join(long)}: too long for a table. Use --to {better}.")
    _note_unreadable(topic, count or 0, left_out)
    return path


def _columns_of(found: Iterator[tuple[int, int, Row]]) -> tuple[list[str], list[str]]:
    """Paths in the order in which they first come, and those of long arrays, which have no column."""
    kinds: dict[str, bool] = {}
    for _, _, row in found:
        for name, value in row.items():
            kinds[name] = kinds.get(name, False) or isinstance(value, np.ndarray)
    return [name for name, is_long in kinds.items() if not is_long], [n for n, long in kinds.items() if long]


def _filled(topic: Topic, path: Path, names: list[str], long: list[str]) -> int | None:
    """Write a table row by row; None as soon as one has other fields, else how many there are."""
    known, count = {*names, *long}, 0
    with path.open("w", newline="", encoding="utf-8") as stream:
        table = csv.writer(stream)
        table.writerow([*TIMES, *names])
        for log, stamp, row in rows_of(topic):
            values = [row.get(name, "") for name in names]
            if not row.keys() <= known or any(isinstance(value, np.ndarray) for value in values):
                return None
            table.writerow([log, stamp, *values])
            count += 1
    return count


def _note_unreadable(topic: Topic, count: int, left_out: list[str]) -> None:
    if count < len(topic):
        left_out.append(f"{topic.name}: {len(topic) - count} messages cannot be read as {topic.type}.")


def write_npz(bag: Bag, path: Path) -> tuple[Path, list[str]]:
    """Write one file with an array for each field of each topic, called `<topic>/<field>`.

    Numbers that a message lacks are NaN; texts are arrays of texts; long arrays, if they are always of one length, are
    rows of one array. Nothing in it needs pickle.

    Returns:
        The file, whose folder is made, and what it lacks, in words.

    Raises:
        BagError: The bag has no messages.
        OSError: It cannot be written.
    """
    left_out: list[str] = []
    topics = _full(bag)
    path.parent.mkdir(parents=True, exist_ok=True)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for topic in topics:
            with ColumnStore() as store:
                for log, stamp, row in rows_of(topic):
                    store.add({"log_ns": log, "stamp_ns": stamp, **row})
                _note_unreadable(topic, store.count, left_out)
                uneven = store.write(archive, topic.name.strip("/"))
                better = " Use --to frames." if topic.type in FRAME_TYPES else ""
                left_out += [f"{topic.name}: {column}: its length changes.{better}" for column in uneven]
    return path, left_out


def _full(bag: Bag) -> list[Topic]:
    found = [topic for topic in bag.topics.values() if len(topic)]
    if not found:
        raise BagError(f"{bag.path}: holds no message to export.")
    return found


def _file_name(topic: Topic) -> str:
    return topic.name.strip("/").replace("/", ".") or "topic"
