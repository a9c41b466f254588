"""Messages as bytes on the wire whose stamp and numbers alone are read and written.

Converting messages between rclpy and the middleware takes a large part of a control step. Messages of the control path
have one layout for as long as a node lives: names and frames stay, a stamp and runs of doubles change.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any, TypeAlias

from rclpy.serialization import deserialize_message, serialize_message

from fulmar_bags.message_reader import NS

Numbers: TypeAlias = Sequence[float]
LATEST_NS = 2**31 * NS  # seconds of a message have 32 bits
_STAMP = struct.Struct("=iI")
_STAMP_AT = 4  # behind the four bytes that name the encoding: the header comes first, its stamp first in it
_WORD = 4  # counts and lengths have so many bytes, and lie at multiples of it


def marks(count: int, *, after: int = 0) -> list[float]:
    """Numbers to fill a message with whose place in its bytes is looked for: no message of ours holds them otherwise.

    Args:
        count: How many.
        after: How many the message holds already.
    """
    return [math.pi * number for number in range(after + 1, after + count + 1)]


class WireImage:
    """Layout of one message in CDR, found by serialising it once.

    The bytes that only fill up to the next multiple are of any value in received messages, and zero in written ones.
    """

    def __init__(
        self, message: Any, *runs: Numbers, texts: Sequence[str], counts: int = 0, before: int = 0
    ) -> None:
        """Find where the numbers lie.

        Args:
            message: Begins with a header, or is a list of one part that begins with it; then texts, then numbers.
            runs: Numbers in the message that lie side by side, in the order of its fields. Each must occur once.
            texts: Every text in the message, in the order of its fields, before the first run.
            counts: Lengths of sequences between the last text and the first run.
            before: Lengths of sequences before the header.

        Raises:
            ValueError: A run is not in the message exactly once, or comes before the one before it; or the message has
                more texts or counts than those.
        """
        image = serialize_message(message)
        self._runs = [struct.Struct(f"={len(run)}d") for run in runs]
        marks = [packing.pack(*run) for packing, run in zip(self._runs, runs, strict=True)]
        self._places = [image.find(mark) for mark in marks]
        if any(image.count(mark) != 1 for mark in marks) or any(a >= b for a, b in pairwise(self._places)):
            raise ValueError(f"{type(message).__name__}: its numbers are not where they are looked for.")
        # Frames, names and counts, with where each begins and ends.
        self._fixed: list[tuple[int, int, bytes]] = []
        self._image = bytearray(len(image))
        self._image[:_WORD] = image[:_WORD]
        self._image[self._places[0] :] = image[self._places[0] :]
        self._stamp_at = _STAMP_AT + before * _WORD
        self._keep(image, _STAMP_AT, self._stamp_at)
        at = self._stamp_at + _STAMP.size
        for text in texts:
            mark = text.encode() + b"\0"
            end = image.index(mark, at + _WORD) + len(mark)  # behind its length
            self._keep(image, at, end)
            at = end + (-end) % _WORD
        self._keep(image, at, at + counts * _WORD)
        # The serialiser leaves room at the end, which a publisher does not send.
        ends = range(self._places[-1] + self._runs[-1].size, len(image) + 1, _WORD)
        length = next((end for end in ends if _holds(self._image[:end], message)), None)
        if length is None:
            raise ValueError(
                f"{type(message).__name__}: {len(texts)} texts and {counts} counts are not its all."
            )
        del self._image[length:]
        self._keep(
            image, self._places[-1] + self._runs[-1].size, length
        )  # such as lengths of empty sequences

    def _keep(self, image: bytes, begin: int, end: int) -> None:
        self._image[begin:end] = image[begin:end]
        if end > begin:
            self._fixed.append((begin, end, image[begin:end]))

    def write(self, time_ns: int, *runs: Numbers) -> bytes:
        """The message with another stamp and other numbers.

        Args:
            time_ns: Stamp; the nearest that a message can hold [ns].
            runs: As many numbers as the constructor got.
        """
        time_ns = min(max(time_ns, -LATEST_NS), LATEST_NS - 1)
        _STAMP.pack_into(self._image, self._stamp_at, *divmod(time_ns, NS))
        for packing, place, run in zip(self._runs, self._places, runs, strict=True):
            packing.pack_into(self._image, place, *run)
        return bytes(self._image)

    def read(self, data: bytes) -> tuple[int, list[tuple[float, ...]]] | None:
        """Stamp [ns] and runs of a received message; None if its layout, frames or names are others."""
        if len(data) < len(self._image) or data[:2] != self._image[:2]:  # a sender may leave room at the end
            return None
        for begin, end, expected in self._fixed:
            if data[begin:end] != expected:
                return None
        seconds, rest = _STAMP.unpack_from(data, self._stamp_at)
        runs = [packing.unpack_from(data, at) for packing, at in zip(self._runs, self._places, strict=True)]
        return seconds * NS + rest, runs


def numbers_in(message: Any, path: str = "") -> Iterator[tuple[str, Any, str, int | None]]:
    """Fields of doubles in the order of the bytes: path, the part that has it, name and length; None: it is no list."""
    for name, kind in message.get_fields_and_field_types().items():
        value = getattr(message, name)
        if hasattr(value, "get_fields_and_field_types"):
            yield from numbers_in(value, f"{path}{name}.")
        elif kind == "double":
            yield f"{path}{name}", message, name, None
        elif kind.startswith(("double[", "sequence<double")):
            yield f"{path}{name}", message, name, len(value)


def layout_of(message: Any, *texts: str) -> WireImage:
    """Image of a message of a header, texts and doubles, in this order; its one run is all the doubles.

    Args:
        message: Its doubles and its stamp are overwritten.
        texts: As `WireImage` takes them.

    Raises:
        ValueError: The message holds something else.
    """
    message.header.stamp = type(message.header.stamp)()
    fields = list(numbers_in(message))
    run = marks(sum(1 if count is None else count for *_, count in fields))
    rest = iter(run)
    for _, part, name, count in fields:
        setattr(part, name, next(rest) if count is None else [next(rest) for _ in range(count)])
    if not run:
        raise ValueError(f"{type(message).__name__} holds no number.")
    return WireImage(message, run, texts=texts, counts=_lengths_before_numbers(message))


def _lengths_before_numbers(message: Any) -> int:
    """How many lengths of sequences stand before the first double, as in a JointState of velocities alone."""
    found = 0
    for name, kind in message.get_fields_and_field_types().items():
        if kind.startswith("sequence<double"):
            found += 1
        if kind.startswith("double") or (kind.startswith("sequence<double") and len(getattr(message, name))):
            break
    return found


def canonical_bytes(message: Any) -> bytes:
    """A message, or its bytes, as bytes that are equal for equal messages; see `message_types.canonical`."""
    if isinstance(message, bytes):
        return message
    from fulmar_bags.message_types import (
        canonical,  # of an extra, and slow to import: only lock step needs it
    )

    cls = type(message)
    return canonical(serialize_message(message), f"{cls.__module__.partition('.')[0]}/msg/{cls.__name__}")


def _holds(data: bytearray, message: Any) -> bool:
    """Whether bytes are a message."""
    try:
        return deserialize_message(bytes(data), type(message)) == message
    except RuntimeError:  # rclpy's error of bytes that end too early has no public name
        return False
