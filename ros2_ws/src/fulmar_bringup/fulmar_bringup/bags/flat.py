"""Messages as plain rows: every number and text of a message under the path of its field."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from fulmar_bringup.bags.contents import Topic
from fulmar_bringup.bags.decode import has_header, messages, stamp_of

MOST_ENTRIES = 64  # of one array; what is longer is a picture or a cloud, and no column
Row = dict[str, Any]


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
        if len(value) <= MOST_ENTRIES:
            for index, entry in enumerate(value):
                yield from _fields(entry, f"{path}[{index}]")
        return
    for name in getattr(value, "__dataclass_fields__", ()):
        if not name.startswith("__"):
            yield from _fields(getattr(value, name), f"{path}.{name}" if path else name)


def columns(found: list[Row]) -> list[str]:
    """Paths of all rows together, in the order in which they first come."""
    return list(dict.fromkeys(path for row in found for path in row))
