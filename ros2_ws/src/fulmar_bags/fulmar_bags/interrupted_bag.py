"""What a recorder that was killed has left of its bag, so that the next one goes on in a further file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fulmar_bags.mcap_file import BEGUN
from fulmar_bags.mcap_records import place_in_bag, plain_name
from fulmar_bags.metadata import BagSpan, read_custom, read_information


@dataclass(frozen=True)
class FinishedPart:
    """One file of a bag that nobody writes any more."""

    name: str
    span: BagSpan
    size: int  # on disk [bytes]
    written_ns: int = 0  # when it was last written, since the epoch [ns]


@dataclass(frozen=True)
class InterruptedBag:
    """A bag so far; nothing where the folder is empty or absent."""

    parts: tuple[FinishedPart, ...] = ()
    next_number: int = 0  # of the next file
    messages: dict[str, int] = field(default_factory=dict)  # by topic
    notes: dict[str, str] = field(default_factory=dict)  # texts of `custom_data`

    @property
    def last_ns(self) -> int:
        """When something was last recorded, since the epoch; 0 without a file [ns].

        The log time of the last message, or the last write to a file that `metadata.yaml` does not count yet.
        """
        return max((part.span.end_ns or part.written_ns for part in self.parts), default=0)


def interrupted_bag(directory: Path) -> InterruptedBag:
    """The bag in a folder, by its files and its `metadata.yaml`.

    That was written with each flush. It lacks what reached the file between its last flush and the recorder's death:
    those messages are in the file, and the counts are lower by them.
    """
    files = sorted((*directory.glob("*.mcap"), *directory.glob(f"*.mcap{BEGUN}")), key=place_in_bag)
    if not files:
        return InterruptedBag()
    information = read_information(directory)
    spans = {str(each.get("path")): _span(each) for each in _dicts(information.get("files"))}
    counts = {
        str(_dict(each.get("topic_metadata")).get("name")): _count(each.get("message_count"))
        for each in _dicts(information.get("topics_with_message_count"))
    }
    parts = (
        FinishedPart(
            file.name, spans.get(file.name, BagSpan(0, 0, 0)), file.stat().st_size, file.stat().st_mtime_ns
        )
        for file in files
        if file.suffix != BEGUN
    )
    return InterruptedBag(
        parts=tuple(parts),
        next_number=1 + max(place_in_bag(plain_name(file))[1] for file in files),
        messages=counts,
        notes=read_custom(directory),
    )


def _span(entry: Mapping[str, Any]) -> BagSpan:
    begin = _count(_dict(entry.get("starting_time")).get("nanoseconds_since_epoch"))
    length = _count(_dict(entry.get("duration")).get("nanoseconds"))
    return BagSpan(_count(entry.get("message_count")), begin, begin + length)


def _dicts(value: object) -> list[dict[str, Any]]:
    return [each for each in value if isinstance(each, dict)] if isinstance(value, list) else []


def _dict(value: object) -> dict[str, Any]:
    return value if isinstance(value, dict) else {}


def _count(value: object) -> int:
    return value if isinstance(value, int) and value > 0 else 0
