"""A bag as rows of plain numbers and texts, and as CSV and NumPy files of them."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from fulmar_bags.contents import Bag, Topic
from fulmar_bags.decode import has_header, messages, stamp_of
from fulmar_core.config.errors import BagError

MOST_ENTRIES = 64  # of one array in columns of their own; what is longer stays together
Row = dict[str, Any]  # numbers, texts, and arrays of what is longer


def rows(topic: Topic) -> tuple[list[int], list[int], list[Row]]:
    """Every message that can be read.

    Returns:
        Times of recording [ns], stamps [ns] (equal to the former where there are none), and fields by path.
    """
    stamped = has_header(topic.type)
    found = messages(topic)
    logs = [log for log, _ in found]
    stamps = [stamp_of(message) if stamped else log for log, message in found]
    return logs, stamps, [dict(_fields(message, "")) for _, message in found]


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
    logs, stamps, found = _rows(topic, left_out)
    names = columns(found)
    long = [name for name in names if any(isinstance(row.get(name), np.ndarray) for row in found)]
    if long:
        left_out.append(f"{topic.name}: {', '.join(long)}: too long for a table. Use --to npz.")
        names = [name for name in names if name not in long]
    with path.open("w", newline="", encoding="utf-8") as stream:
        table = csv.writer(stream)
        table.writerow([*TIMES, *names])
        for log, stamp, row in zip(logs, stamps, found, strict=True):
            table.writerow([log, stamp, *(row.get(name, "") for name in names)])
    return path


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
    arrays: dict[str, Any] = {}
    left_out: list[str] = []
    for topic in _full(bag):
        logs, stamps, found = _rows(topic, left_out)
        name = topic.name.strip("/")
        arrays[f"{name}/log_ns"] = np.array(logs, dtype=np.int64)
        arrays[f"{name}/stamp_ns"] = np.array(stamps, dtype=np.int64)
        for column in columns(found):
            values: list[Any] = [row.get(column) for row in found]
            arrays_among = any(isinstance(value, np.ndarray) for value in values)
            if arrays_among and len({np.shape(value) for value in values}) > 1:
                left_out.append(f"{topic.name}: {column}: its length changes.")
                continue
            arrays[f"{name}/{column}"] = _array(values)
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savez_compressed(path, allow_pickle=False, **arrays)
    return path, left_out


def _rows(topic: Topic, left_out: list[str]) -> tuple[list[int], list[int], list[Row]]:
    logs, stamps, found = rows(topic)
    if len(found) < len(topic):
        left_out.append(f"{topic.name}: {len(topic) - len(found)} messages cannot be read as {topic.type}.")
    return logs, stamps, found


def _array(values: list[Any]) -> np.ndarray:
    if isinstance(values[0], np.ndarray):
        return np.stack(values)
    if any(isinstance(value, str) for value in values):
        return np.array(["" if value is None else str(value) for value in values])
    return np.array([np.nan if value is None else value for value in values])


def _full(bag: Bag) -> list[Topic]:
    found = [topic for topic in bag.topics.values() if len(topic)]
    if not found:
        raise BagError(f"{bag.path}: holds no message to export.")
    return found


def _file_name(topic: Topic) -> str:
    return topic.name.strip("/").replace("/", ".") or "topic"
