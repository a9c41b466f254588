"""A bag as files that other programs read: CSV and NumPy."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import numpy as np

from fulmar_bringup.bags.contents import Bag, Topic
from fulmar_bringup.bags.flat import columns, rows

TIMES = ("log_ns", "stamp_ns")


def write_csv(bag: Bag, folder: Path) -> list[Path]:
    """Write one table for each topic that has messages.

    Args:
        bag: The bag.
        folder: Is made.

    Returns:
        The files. First two columns: when it was recorded and its stamp [ns]; then every field by its path.

    Raises:
        OSError: The folder cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    return [_write_table(topic, folder / f"{_file_name(topic)}.csv") for topic in _full(bag)]


def _write_table(topic: Topic, path: Path) -> Path:
    logs, stamps, found = rows(topic)
    names = columns(found)
    with path.open("w", newline="", encoding="utf-8") as stream:
        table = csv.writer(stream)
        table.writerow([*TIMES, *names])
        for log, stamp, row in zip(logs, stamps, found, strict=True):
            table.writerow([log, stamp, *(row.get(name, "") for name in names)])
    return path


def write_npz(bag: Bag, path: Path) -> Path:
    """Write one file with an array for each field of each topic, called `<topic>/<field>`.

    Numbers that a message lacks are NaN; texts are arrays of texts. Nothing in it needs pickle.

    Args:
        bag: The bag.
        path: Of the file; its folder is made.

    Raises:
        OSError: It cannot be written.
    """
    arrays: dict[str, Any] = {}
    for topic in _full(bag):
        logs, stamps, found = rows(topic)
        name = topic.name.strip("/")
        arrays[f"{name}/log_ns"] = np.array(logs, dtype=np.int64)
        arrays[f"{name}/stamp_ns"] = np.array(stamps, dtype=np.int64)
        for column in columns(found):
            values = [row.get(column) for row in found]
            arrays[f"{name}/{column}"] = _array(values)
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savez_compressed(path, allow_pickle=False, **arrays)
    return path


def _array(values: list[Any]) -> np.ndarray:
    if any(isinstance(value, str) for value in values):
        return np.array(["" if value is None else str(value) for value in values])
    return np.array([np.nan if value is None else value for value in values])


def _full(bag: Bag) -> list[Topic]:
    return [topic for topic in bag.topics.values() if len(topic)]


def _file_name(topic: Topic) -> str:
    return topic.name.strip("/").replace("/", ".") or "topic"
