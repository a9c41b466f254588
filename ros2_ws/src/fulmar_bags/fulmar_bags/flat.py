"""Messages as plain rows: every number and text of a message under the path of its field."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from fulmar_bags.contents import Topic
from fulmar_bags.decode import has_header, messages, stamp_of

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
