"""Check of configuration values against `plausible_ranges`: refuse mistakes of unit, warn of the unusual."""

from __future__ import annotations

import logging
import math
from collections.abc import Iterator, Sequence
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

from fulmar_core.config.errors import ImplausibleError
from fulmar_core.config.plausible_ranges import UNITS, Plausible, Range
from fulmar_core.config.strict_yaml import line_of

LEAST_SHARE = 0.02  # of the largest usual value: where 0 is usual, less is no likely unit
logger = logging.getLogger(__name__)
# A program shows warnings once; nodes that load the same file again stay silent.
logger.addHandler(logging.NullHandler())


def check_plausible(config: Any, table: Sequence[Plausible], path: Path) -> None:
    """Reject values that no robot, task or scenario has; log a warning for those that few have.

    Raises:
        ImplausibleError: A value lies outside of what is possible; the message starts with `file:line`.
    """
    for row in table:
        for keys, found in _found(config, row):
            value = math.hypot(*found[:2]) if row.distance else float(found)
            scale = row.scale(config) if row.scale else 1.0
            if (value == 0.0 and not row.zero) or scale == 0.0:
                continue
            inside, usual = _times(row.possible, scale), _times(row.usual, scale)
            if _lies_in(value, usual):
                continue
            where = f"{path}:{line_of(path, keys)}: '{'.'.join(keys)}' = {_number(found, value)} {row.unit}"
            allowed = f"{_text(usual)} {row.unit} ({row.why})"
            if not _lies_in(value, inside):
                raise ImplausibleError(
                    f"{where} is not plausible. Usual is {allowed}, accepted is {_text(inside)} {row.unit}."
                    f"{_other_unit(value, row.unit, usual)}"
                )
            logger.warning(
                "%s is unusual; usual is %s.%s", where, allowed, _other_unit(value, row.unit, usual)
            )


def _found(config: Any, row: Plausible) -> Iterator[tuple[tuple[str, ...], Any]]:
    """What a row is about, with its keys: values that stand in the file, or one that follows from them."""
    keys = tuple(row.key.split("."))
    if row.of is None:
        yield from _values(config, keys)
    elif (value := row.of(config)) is not None:
        yield keys, value


def _values(
    config: Any, keys: Sequence[str], before: tuple[str, ...] = ()
) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Values at a dotted path with their own keys; none where the file has no such part."""
    if not keys:
        if config is not None:
            yield before, config
        return
    key, rest = keys[0], keys[1:]
    if isinstance(config, tuple):
        every = range(len(config))
        for index in every if key == "*" else {int(key)}.intersection(every):
            yield from _values(config[index], rest, (*before, str(index)))
    elif is_dataclass(config) and key in {field.name for field in fields(config)}:
        yield from _values(getattr(config, key), rest, (*before, key))


def _times(span: Range, scale: float) -> Range:
    return span[0] * scale, span[1] * scale


def _lies_in(value: float, span: Range) -> bool:
    """Whether a value lies in a range, rounding left aside."""
    slack = 1e-9 * max(abs(span[0]), abs(span[1]))
    return span[0] - slack <= value <= span[1] + slack


def _text(span: Range) -> str:
    return f"{span[0]:.4g} to {span[1]:.4g}"


def _number(found: Any, value: float) -> str:
    return f"{list(found)}, {value:.4g}" if isinstance(found, tuple) else f"{value:g}"


def _other_unit(value: float, unit: str, usual: Range) -> str:
    """Units in which a value would be usual, as a question, of decimal multiples the first; empty if there is none."""
    least = 0.0 if usual[0] > 0.0 else LEAST_SHARE * max(map(abs, usual))
    found: dict[str, float] = {}
    for other, factor in UNITS.get(unit, ()):
        decimal = any(round(math.log10(factor / each), 9).is_integer() for each in found.values())
        if usual[0] <= value * factor <= usual[1] and abs(value * factor) >= least and not decimal:
            found[other] = factor
    if not found:
        return ""
    means = ", ".join(f"{value:g} {other} are {value * factor:.4g} {unit}" for other, factor in found.items())
    return f" Is it in {' or '.join(found)}? {means}, and the key is in {unit}."
