"""Diagnostics of a bag, read six times as fast as any message: a minute of a system has hundreds of long ones."""

from __future__ import annotations

import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from fulmar_bags.message_types import ENCAPSULATION, LITTLE_ENDIAN, PADDING, type_store

_LENGTH = struct.Struct("<I")
_STAMP_BYTES = 8


@dataclass(frozen=True)
class StatusReport:
    """One status of a DiagnosticArray; `level` as there: 0 ok, 1 warn, 2 error, 3 stale."""

    name: str
    level: int
    message: str
    values: dict[str, str]


class Recorded(Protocol):
    """Messages of one topic, such as a `Topic`."""

    data: Sequence[bytes]  # in CDR
    log_ns: Sequence[int]  # when each was received [ns]


def statuses(topic: Recorded, of: str = "") -> Iterator[tuple[int, list[StatusReport]]]:
    """Time of recording [ns] and statuses of each message of type DiagnosticArray that can be read.

    Args:
        topic: Of this type.
        of: Text without which a message is left out.
    """
    text = of.encode()
    for log_ns, data in zip(topic.log_ns, topic.data, strict=True):
        if text not in data:
            continue
        try:
            yield log_ns, _read(data)
        except Exception:  # noqa: BLE001 - foreign bytes raise whatever they please
            continue


def unreadable_statuses(data: Sequence[bytes]) -> list[int]:
    """Indices of messages that are no DiagnosticArray; see `message_types.unreadable`."""
    found = []
    for index, each in enumerate(data):
        try:
            _read(each)
        except Exception:  # noqa: BLE001 - foreign bytes raise whatever they please
            found.append(index)
    return found


def _read(data: bytes) -> list[StatusReport]:
    if data[1] != LITTLE_ENDIAN:
        return [_of(status) for status in _deserialized(data).status]
    if data[0]:
        raise ValueError("another encapsulation")
    _, at = _text(data, ENCAPSULATION + _STAMP_BYTES)  # of the header's frame
    count, at = _count(data, at)
    found = []
    for _ in range(count):
        level = data[at]
        name, at = _text(data, at + 1)
        message, at = _text(data, at)
        _, at = _text(data, at)  # of the hardware
        pairs, at = _count(data, at)
        values = {}
        for _ in range(pairs):
            key, at = _text(data, at)
            values[key], at = _text(data, at)
        found.append(StatusReport(name, level, message, values))
    if len(data) - at > PADDING:
        raise ValueError("more follows")
    return found


def _count(data: bytes, at: int) -> tuple[int, int]:
    """A number that is aligned to four bytes, and where it ends."""
    at += -at % 4  # the encapsulation has four bytes itself
    return _LENGTH.unpack_from(data, at)[0], at + 4


def _text(data: bytes, at: int) -> tuple[str, int]:
    length, at = _count(data, at)
    if at + length > len(data):
        raise ValueError("torn off")
    return data[at : at + length].rstrip(b"\0").decode(), at + length


def _deserialized(data: bytes) -> Any:
    return type_store().deserialize_cdr(data, "diagnostic_msgs/msg/DiagnosticArray")


def _of(status: Any) -> StatusReport:
    values = {pair.key: pair.value for pair in status.values}
    return StatusReport(status.name, int(status.level), status.message, values)
