"""Messages read from bytes without rclpy's conversion, as long as their frames, names and lengths stay."""

from __future__ import annotations

import array
import contextlib
import copy
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
from builtin_interfaces.msg import Time

from fulmar_bags.message_reader import NS
from fulmar_ros.convert import deserialized
from fulmar_ros.wire_image import layout_of

MOST_LAYOUTS = 4  # of one topic that are learned, such as those of a period with and without a slow sensor


class BytesReader:
    """Reads messages of one type; those of a header, texts and doubles fill one object with the same fields.

    Deserialising builds every part of a message anew, which costs several times what the numbers in it cost.
    """

    def __init__(self, kind: type) -> None:
        """Read messages of a class."""
        self._kind = kind
        self._known: list[_Layout] = []
        self._tries = MOST_LAYOUTS

    def read(self, data: bytes) -> Any:
        """The message, or an object with its fields that the next one overwrites; None for bytes that are none."""
        for layout in self._known:
            message = layout.read(data)
            if message is not None:
                return message
        message = deserialized(data, self._kind)
        if message is not None and self._tries:
            self._tries -= 1
            with contextlib.suppress(ValueError):  # it holds something else: it is deserialised each time
                self._known.append(_Layout(message))
        return message

    def passing(self, callback: Callable[[Any], None]) -> Callable[[bytes], None]:
        """A callback of a subscription with `raw=True` that passes messages on."""

        def receive(data: bytes) -> None:
            message = self.read(data)
            if message is not None:
                callback(message)

        return receive


class _Layout:
    """Where the stamp and the numbers of one message lie, and the object that they are written to."""

    def __init__(self, message: Any) -> None:
        """Learn it from a message.

        Raises:
            ValueError: It is more than a header, texts and doubles, in this order.
        """
        self._fields: list[
            tuple[Any, str, Any, int | slice]
        ] = []  # part, field, how it is listed, and where it is
        self._count = 0
        texts: list[str] = []
        if next(iter(message.get_fields_and_field_types()), "") != "header":
            raise ValueError(f"{type(message).__name__} does not begin with a header.")
        self._message = self._same(message, texts)
        self._stamp = self._message.header.stamp
        self._image = layout_of(copy.deepcopy(message), *texts)

    def read(self, data: bytes) -> Any:
        """The object with the numbers of a message; None if its layout is another."""
        found = self._image.read(data)
        if found is None:
            return None
        time_ns, (numbers,) = found
        self._stamp.sec, self._stamp.nanosec = divmod(time_ns, NS)
        for part, name, listed, place in self._fields:
            setattr(part, name, numbers[place] if listed is None else listed(numbers[place]))
        return self._message

    def _same(self, message: Any, texts: list[str]) -> SimpleNamespace:
        """An object with the fields of a message, of which those with numbers are noted."""
        same = SimpleNamespace()
        for name, kind in message.get_fields_and_field_types().items():
            value = getattr(message, name)
            if isinstance(value, Time) and not (texts or self._fields):
                value = SimpleNamespace(sec=0, nanosec=0)
            elif hasattr(value, "get_fields_and_field_types"):
                value = self._same(value, texts)
            elif kind == "double":
                self._note(same, name, None, 1)
            elif kind.startswith("double["):
                self._note(same, name, np.array, len(value))
            elif kind.startswith("sequence<double"):
                self._note(same, name, _doubles, len(value))
            elif kind in ("string", "sequence<string>") and not self._fields:
                texts += [value] if kind == "string" else value
            else:
                raise ValueError(
                    f"{type(message).__name__}.{name} is neither a text before numbers nor a number."
                )
            setattr(same, name, value)
        return same

    def _note(self, part: SimpleNamespace, name: str, listed: Any, count: int) -> None:
        place = self._count if listed is None else slice(self._count, self._count + count)
        if count:
            self._fields.append((part, name, listed, place))
        self._count += count


def _doubles(numbers: tuple[float, ...]) -> array.array[float]:
    return array.array("d", numbers)
