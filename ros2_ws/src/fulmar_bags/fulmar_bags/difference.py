"""What differs between two bags, topic by topic and field by field."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from fulmar_bags.comparison import Field, compare
from fulmar_bags.contents import Bag, Topic
from fulmar_bags.figures import provenance
from fulmar_bags.flat import Row, columns, rows
from fulmar_core.errors import UnknownNameError
from fulmar_core.robot_name import Frames
from fulmar_core.topics import CLOCK, DIAGNOSTICS, METADATA, STATUS

# They tell of the machine and of this very run, not of what the robot did.
OF_THE_MACHINE = (CLOCK, DIAGNOSTICS, STATUS, METADATA)
ORIGIN = (
    "robot",
    "name",
    "task",
    "controller",
    "policy",
    "scenario",
    "seed",
    "control_hz",
    "git_revision",
    "controller_sha256",
)


def differing(
    first: Bag, second: Bag, *, tolerance: float = 0.0, only: list[str] | None = None
) -> dict[str, Any]:
    """Compare two bags.

    Messages of one topic belong together by their stamp, or by their number where they have none; topics by their name
    without the robot's. Nor does its name count in the names of frames.

    Args:
        first: One bag.
        second: Another.
        tolerance: Largest difference of numbers that counts as the same; 0 asks for the same bits.
        only: Topics, relative or absolute; by default all but those that tell of the machine.

    Returns:
        Ready for JSON, with `same`, which takes that something was compared. Topics with messages that cannot be read
        are compared byte by byte, in their order.

    Raises:
        ConfigError: A topic that neither bag has.
    """
    one, other = _by_name(first), _by_name(second)
    known = sorted({*one, *other})
    wanted = (
        [second.relative(first.relative(name)) for name in only]
        if only
        else [n for n in known if n not in _machine()]
    )
    for name in wanted:
        if name not in known:
            raise UnknownNameError("topic", name, known)
    frames = first.frames, second.frames
    topics = [_of_topic(name, one.get(name), other.get(name), tolerance, frames) for name in wanted]
    compared = sum(min(topic["counts"]) for topic in topics)
    before, after = provenance(first), provenance(second)
    return {
        "bags": [str(first.path), str(second.path)],
        "provenance": {key: [before[key], after[key]] for key in ORIGIN if before[key] != after[key]},
        "topics": topics,
        "compared": compared,
        "same": compared > 0 and all(topic["same"] for topic in topics),
    }


def _machine() -> set[str]:
    return {wire.name for wire in OF_THE_MACHINE}


def _by_name(bag: Bag) -> dict[str, Topic]:
    return {bag.relative(name): topic for name, topic in bag.topics.items() if len(topic)}


def _rows(topic: Topic, frames: Frames) -> tuple[list[int], list[Row]]:
    """Stamps and fields of messages, with frames without the prefix of their robot."""
    _, stamps, found = rows(topic)
    for row in found:
        row.update({path: frames.plain(text) for path, text in row.items() if _is_frame(path, text)})
    return stamps, found


def _is_frame(path: str, value: Any) -> bool:
    return path.endswith("frame_id") and isinstance(value, str)


def _of_topic(
    name: str, first: Topic | None, second: Topic | None, tolerance: float, frames: tuple[Frames, Frames]
) -> dict[str, Any]:
    result: dict[str, Any] = {
        "topic": name,
        "counts": [len(first) if first else 0, len(second) if second else 0],
        "only_first": 0,
        "only_second": 0,
        "fields": [],
        "texts": [],
        "bytes": 0,
    }
    if first is None or second is None or first.type != second.type:
        types = [topic.type if topic else None for topic in (first, second)]
        return {**result, "types": types, "same": False}
    stamps_1, rows_1 = _rows(first, frames[0])
    stamps_2, rows_2 = _rows(second, frames[1])
    if len(rows_1) < len(first) or len(rows_2) < len(second):
        return {**result, **_bytes_of(first, second)}
    pairs, alone_1, alone_2 = _pairs(stamps_1, stamps_2)
    left, right = [rows_1[i] for i, _ in pairs], [rows_2[j] for _, j in pairs]
    stamps = np.array([stamps_1[i] for i, _ in pairs], dtype=np.int64)
    paths = [path for path in columns(left + right) if not path.startswith("header.stamp")]
    numbers = [
        path for path in paths if _all(left + right, path, lambda v: not isinstance(v, str | np.ndarray))
    ]
    fields = _numbers(numbers, left, right, stamps, tolerance)
    texts = [
        {"field": path, "differing": count}
        for path in paths
        if path not in numbers
        and (
            count := sum(
                not _alike(a.get(path), b.get(path), tolerance) for a, b in zip(left, right, strict=True)
            )
        )
    ]
    return {
        **result,
        "only_first": alone_1,
        "only_second": alone_2,
        "fields": [vars(field) for field in fields if not field.same],
        "texts": texts,
        "same": not (alone_1 or alone_2 or texts) and all(field.same for field in fields),
    }


def _bytes_of(first: Topic, second: Topic) -> dict[str, Any]:
    """What differs between messages that nobody here can read."""
    alone = len(first) - len(second)
    differing = sum(a != b for a, b in zip(first.data, second.data, strict=False))
    return {
        "only_first": max(alone, 0),
        "only_second": max(-alone, 0),
        "bytes": differing,
        "same": not (alone or differing),
    }


def _alike(one: Any, other: Any, tolerance: float) -> bool:
    """Whether two texts or two arrays are the same; numbers to the bit where the tolerance is 0."""
    if not (isinstance(one, np.ndarray) and isinstance(other, np.ndarray)):
        return type(one) is type(other) and bool(one == other)
    if one.shape != other.shape or one.dtype.kind == "U":
        return np.array_equal(one, other)
    if tolerance == 0.0:
        return one.tobytes() == other.tobytes()
    return bool(
        np.isclose(one.astype(float), other.astype(float), rtol=0.0, atol=tolerance, equal_nan=True).all()
    )


def _all(found: list[Row], path: str, holds: Callable[[Any], bool]) -> bool:
    return all(holds(row[path]) for row in found if path in row)


def _numbers(
    paths: list[str], left: list[Row], right: list[Row], stamps: np.ndarray, tolerance: float
) -> list[Field]:
    if not left or not paths:
        return []
    nothing = float("nan")
    one, other = (
        np.array([[float(row.get(path, nothing)) for path in paths] for row in found])
        for found in (left, right)
    )
    return compare("", paths, one, other, stamps, tolerance)


def _pairs(first: list[int], second: list[int]) -> tuple[list[tuple[int, int]], int, int]:
    """Which messages belong together, by their times; how many of each side are alone.

    Where no time is common, as without stamps, they are taken in their order.
    """
    waiting: dict[int, list[int]] = {}
    for index in range(len(second) - 1, -1, -1):
        waiting.setdefault(second[index], []).append(index)
    pairs = []
    for index, time in enumerate(first):
        mine = waiting.get(time)
        if mine:
            pairs.append((index, mine.pop()))
    if not pairs:
        pairs = [(i, i) for i in range(min(len(first), len(second)))]
    return pairs, len(first) - len(pairs), len(second) - len(pairs)
