"""The arrays and numbers in what moves: taken out in a fixed order, and put back."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain
from operator import attrgetter
from typing import Any

from fulmar_core.disturbances.world import FIELDS, World
from fulmar_core.goal import Goal
from fulmar_core.planar import COLUMNS, PlanarState

Moving = dict[str, Any]  # as of `MutableState.mutable_state`, with dictionaries in it
Parts = dict[str, Any]  # the same without; what was in a dictionary has a name of two words

_RECORDS = {PlanarState: COLUMNS, World: FIELDS}
_LEAVES_OF = {Goal: Goal.arrays, **{kind: attrgetter(*names) for kind, names in _RECORDS.items()}}


def parts_of(moving: Moving) -> Parts:
    """Everything by itself."""
    parts: Parts = {}
    for name, value in moving.items():
        if isinstance(value, dict):
            parts |= {f"{name} {inner}": part for inner, part in value.items()}
        else:
            parts[name] = value
    return parts


def moving_of(parts: Parts) -> Moving:
    """The inverse of `parts_of`."""
    moving: Moving = {}
    for name, part in parts.items():
        outer, _, inner = name.partition(" ")
        if inner:
            moving.setdefault(outer, {})[inner] = part
        else:
            moving[name] = part
    return moving


def leaves(part: Any) -> tuple[Any, ...]:
    """Arrays and numbers of a part; nothing has none."""
    if type(part) in _LEAVES_OF:
        found: tuple[Any, ...] = _LEAVES_OF[type(part)](part)
        return found
    if isinstance(part, (tuple, list)):
        return tuple(chain.from_iterable(leaves(inner) for inner in part))
    return () if part is None else (part,)


def rebuilt(part: Any, new: Iterator[Any]) -> Any:
    """A part of the same kind with other leaves, as many as `leaves` finds, in its order."""
    if isinstance(part, Goal):
        return part.mapped(lambda _: next(new))
    if type(part) in _RECORDS:
        return type(part)(*(next(new) for _ in _RECORDS[type(part)]))
    if isinstance(part, (tuple, list)):
        return type(part)(rebuilt(inner, new) for inner in part)
    return None if part is None else next(new)
