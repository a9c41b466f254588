"""Differences of two recordings, number by number; of two bags, topic by topic and field by field."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from fulmar_bags.contents import Bag
from fulmar_bags.decode import by_stamp
from fulmar_bags.figures import provenance
from fulmar_bags.gathered import Topic
from fulmar_bags.tables import Row, columns, rows
from fulmar_core.config.errors import ConfigError, UnknownNameError
from fulmar_core.robots.topics import (
    CLOCK,
    DIAGNOSTICS,
    METADATA,
    OPERATOR_ACTION,
    ROBOT_INFO,
    STATUS,
    SWAP_RESULT,
)
from fulmar_core.wires.robot_name import Frames


@dataclass(frozen=True)
class Field:
    """One number over all steps."""

    field: str  # such as `action`
    name: str  # such as `thruster_1`
    compared: int  # steps where both have it
    differing: int  # steps where they differ by more than the tolerance, or one alone has it
    tolerance: float
    first_step: int | None  # where they first differ
    first_stamp_s: float | None  # [s]
    recorded: float | None  # there
    found: float | None  # there
    difference: dict[str, float] | None  # p50, p99 and max of the absolute difference

    @property
    def same(self) -> bool:
        """Whether nothing differs."""
        return self.differing == 0


def compare(
    field: str,
    names: Sequence[str],
    recorded: np.ndarray,
    found: np.ndarray,
    stamp_ns: np.ndarray,
    tolerance: float = 0.0,
) -> list[Field]:
    """Compare vectors entry by entry.

    Args:
        field: Name of the vectors.
        names: Of their entries.
        recorded: Shape (n, m), NaN where there is none.
        found: Same.
        stamp_ns: Of the steps, shape (n,) [ns].
        tolerance: Largest difference that counts as the same; 0 asks for the same bits.
    """
    return [
        _field(field, name, recorded[:, i], found[:, i], stamp_ns, tolerance) for i, name in enumerate(names)
    ]


def _field(
    field: str, name: str, recorded: np.ndarray, found: np.ndarray, stamp_ns: np.ndarray, tolerance: float
) -> Field:
    here, there = ~np.isnan(recorded), ~np.isnan(found)
    both = here & there
    gap = np.zeros(len(recorded))
    with np.errstate(invalid="ignore"):  # infinite in both
        gap[both] = np.abs(found[both] - recorded[both])
    if tolerance == 0.0:
        same_bits = _bits(recorded) == _bits(found)
        differs = np.where(both, ~same_bits, here != there)
    else:
        differs = np.where(both, ~((gap <= tolerance) | (recorded == found)), here != there)
    first = int(np.argmax(differs)) if differs.any() else None
    spread = None
    if both.any():
        finite = gap[both][np.isfinite(gap[both])]
        if len(finite):
            p50, p99 = np.percentile(finite, (50, 99))
            spread = {"p50": float(p50), "p99": float(p99), "max": float(finite.max())}
    return Field(
        field,
        name,
        int(both.sum()),
        int(differs.sum()),
        tolerance,
        first,
        float(stamp_ns[first]) / 1e9 if first is not None else None,
        _known(recorded[first]) if first is not None else None,
        _known(found[first]) if first is not None else None,
        spread,
    )


def _bits(values: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(values, dtype="<f8").view("<i8")


def _known(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def first_difference(fields: Sequence[Field]) -> Field | None:
    """The field that differs first; of several at one step, the first in the list."""
    differing = [each for each in fields if each.first_step is not None]
    return min(differing, key=lambda each: each.first_step or 0) if differing else None


def as_json(fields: Sequence[Field]) -> list[dict[str, Any]]:
    """Lines for JSON."""
    return [asdict(each) for each in fields]


def read_tolerances(texts: Sequence[str], fields: Sequence[str]) -> Mapping[str, float]:
    """Tolerance of each field, 0 by default, from texts such as `1e-6` for all or `action=1e-6`; later ones win.

    Raises:
        ConfigError: No number, a negative one, or an unknown field.
    """
    found = dict.fromkeys(fields, 0.0)
    for text in texts:
        name, _, number = text.rpartition("=")
        try:
            value = float(number)
        except ValueError:
            value = -1.0
        if not 0.0 <= value < np.inf:
            raise ConfigError(
                f"--tolerance {text}: must be a number of at least 0, or FIELD=NUMBER. "
                f"Example: --tolerance {fields[0]}=1e-6"
            )
        if name and name not in found:
            raise UnknownNameError("field", name, fields)
        for each in [name] if name else list(fields):
            found[each] = value
    return found


# About the computer and the single run, not about what the robot did.
OF_THE_MACHINE = (CLOCK, DIAGNOSTICS, STATUS, METADATA, OPERATOR_ACTION, ROBOT_INFO, SWAP_RESULT)
ORIGIN = (
    "robot", "name", "task", "controller", "policy", "scenario", "seed", "control_hz", "git_revision",
    "controller_sha256",
)  # fmt: skip


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
        only: Topics, relative or absolute; by default all but those about the computer.

    Returns:
        Ready for JSON, with `same`, which takes that something was compared. Topics with messages that cannot be read
        are compared byte by byte, in their order.

    Raises:
        ConfigError: A topic that neither bag has.
    """
    one, other = _by_name(first), _by_name(second)
    known = sorted({*one, *other})
    machine = {wire.name for wire in OF_THE_MACHINE}
    wanted = [name for name in known if name not in machine]
    if only:
        wanted = [second.relative(first.relative(name)) for name in only]
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


def _by_name(bag: Bag) -> dict[str, Topic]:
    return {bag.relative(name): topic for name, topic in bag.topics.items() if len(topic)}


def _rows(topic: Topic, frames: Frames) -> tuple[list[int], list[Row]]:
    """Stamps and fields of messages, with frames without the prefix of their robot."""
    _, stamps, found = rows(topic)
    for row in found:
        frame_ids = {p: v for p, v in row.items() if p.endswith("frame_id") and isinstance(v, str)}
        row.update({path: frames.plain(text) for path, text in frame_ids.items()})
    return stamps, found


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
    both = left + right
    numbers = [p for p in paths if not any(isinstance(row.get(p), str | np.ndarray) for row in both)]
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
    """Differences of messages that cannot be read."""
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
    waiting = by_stamp(second)
    pairs = []
    for index, time in enumerate(first):
        mine = waiting.get(time)
        if mine:
            pairs.append((index, mine.pop()))
    if not pairs:
        pairs = [(i, i) for i in range(min(len(first), len(second)))]
    return pairs, len(first) - len(pairs), len(second) - len(pairs)
