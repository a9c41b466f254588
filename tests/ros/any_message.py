"""Messages of ROS with any content in every field, for searches with hypothesis."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np
from geometry_msgs.msg import Quaternion
from hypothesis import strategies as st

INTEGERS = {
    "uint8": (0, 2**8 - 1),
    "uint16": (0, 2**16 - 1),
    "uint32": (0, 2**32 - 1),
    "int32": (-(2**31), 2**31 - 1),
}
numbers = st.sampled_from([0.0, 1.0, -1.0, 1e-3, 1e308, 4294967295.0]) | st.floats()
texts = st.sampled_from(["odom", "map", "", "base_link", "wheel_x", "wheel_y", "wheel_z"]) | st.text(
    max_size=4
)


def of_field(kind: str) -> st.SearchStrategy[Any]:
    """Any value of a field of a message."""
    if kind.startswith("sequence<"):
        return st.lists(of_field(kind[9:-1]), max_size=4)
    if kind.endswith("]"):
        part, count = kind[:-1].split("[")
        few = st.lists(st.tuples(st.integers(0, int(count) - 1), numbers), max_size=3)
        return few.map(lambda found: _filled(int(count), found)) if part == "double" else st.nothing()
    if kind in ("double", "float"):
        return numbers
    if kind in INTEGERS:
        return st.integers(*INTEGERS[kind])
    if kind == "boolean":
        return st.booleans()
    if kind == "octet":
        return st.binary(min_size=1, max_size=1)
    return texts if kind == "string" else any_message(_class_of(kind))


def _class_of(kind: str) -> Any:
    package, name = kind.split("/")
    return getattr(importlib.import_module(f"{package}.msg"), name)


def _filled(count: int, entries: list[tuple[int, float]]) -> np.ndarray:
    found = np.zeros(count)
    for index, value in entries:
        found[index] = value
    return found


@st.composite
def any_message(draw: st.DrawFn, cls: Any) -> Any:
    """Any content in every field."""
    if cls is Quaternion and draw(st.booleans()):
        return Quaternion(w=1.0)
    message = cls()
    for name, kind in cls.get_fields_and_field_types().items():
        setattr(message, name, draw(of_field(kind)))
    return message
