"""A robot's file as text, each line with a comment that says unit, origin, and what measures the value."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from fulmar_core.config.yaml_text import dump

DIGITS = 12  # of written numbers: what is less is rounding
WIDTH = 118  # of a line with its comment


def robot_text(robot: Mapping[str, Any], head: list[str], comment: Callable[[str], str]) -> str:
    """Write a robot's file.

    Args:
        robot: Its keys, of plain types.
        head: Lines of the comment above everything.
        comment: From a dotted key to its comment; empty for none.
    """
    lines = [
        wrapped
        for line in head
        for wrapped in textwrap.wrap(
            f"# {line}", WIDTH, subsequent_indent="#       ", break_long_words=False, break_on_hyphens=False
        )
    ]
    for key, value in robot.items():
        if isinstance(value, dict) or key == "look":
            lines.append("")
        lines += _lines(key, value, key, comment, "")
    return "\n".join(lines) + "\n"


def _lines(key: str, value: Any, path: str, comment: Callable[[str], str], indent: str) -> Iterator[str]:
    said = comment(path)
    if _is_single(value):
        (inner,) = value
        yield _line(f"{indent}{key}: {_flow(value)}", said or comment(f"{path}.{inner}"))
    elif isinstance(value, Mapping) and value:
        yield _line(f"{indent}{key}:", said)
        for inner, each in value.items():
            yield from _lines(inner, each, f"{path}.{inner}", comment, f"{indent}  ")
    elif isinstance(value, (list, tuple)) and any(isinstance(each, Mapping) for each in value):
        if said:
            yield f"{indent}# {said}"
        yield f"{indent}{key}:"
        yield from (f"{indent}  - {_flow(each)}" for each in value)
    else:
        written = f"{indent}{key}: {_flow(value)}"
        if len(written) + len(said) + 3 > WIDTH and said:
            yield f"{indent}# {said}"
            said = ""
        yield _line(written, said)


def _line(text: str, said: str) -> str:
    return f"{text} # {said}" if said else text


def _flow(value: Any) -> str:
    """A value on one line."""
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key}: {_flow(each)}" for key, each in value.items()) + "}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(_flow, value)) + "]"
    if isinstance(value, float):
        value = float(f"{value:.{DIGITS}g}") + 0.0  # no minus zero
    return dump(value).removesuffix("...\n").strip()


def _is_single(value: Any) -> bool:
    """Whether a value is a mapping of one key with a plain value."""
    return (
        isinstance(value, Mapping)
        and len(value) == 1
        and not any(isinstance(each, (Mapping, list)) for each in value.values())
    )
