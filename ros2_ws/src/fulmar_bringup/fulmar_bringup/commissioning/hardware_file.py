"""The order or wiring that was found, as a line of the hardware file."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from fulmar_core.atomic_write import write_whole
from fulmar_core.errors import ConfigError


def line_of(key: str, values: Sequence[object]) -> str:
    """The line to write, such as `order: [5, 1, 3, 7, 0, 4, 6, 2]`."""
    return f"{key}: [{', '.join(map(str, values))}]"


def with_line(text: str, key: str, values: Sequence[object]) -> str:
    """A hardware file with another value of one key; everything else stays, comments too.

    Args:
        text: The file.
        key: `order` or `wiring`, below `driver`.
        values: Its new entries.

    Returns:
        The new text; the comment behind a replaced value goes, since it spoke of the old one.

    Raises:
        ConfigError: The file is written in a way that no line can be replaced in.
    """
    new = line_of(key, values)
    in_line = re.compile(rf"(?<![\w-]){key}:[ \t]*(\[[^\]\n]*\]|[\w-]+)")
    found = list(in_line.finditer(_without_comments(text)))
    if len(found) == 1:
        begin, end = found[0].span()
        rest = text[end:]
        comment = re.match(r"[ \t]*#[^\n]*", rest)
        return text[:begin] + new + (rest[comment.end() :] if comment else rest)
    block = re.search(r"^(?P<indent>[ \t]+)kind:[^\n]*\n", text, re.MULTILINE)
    if found or block is None or re.search(rf"^\s*{key}:", text, re.MULTILINE):
        raise ConfigError(f"the file has no single-line '{key}' to replace. Write into it: {new}")
    return f"{text[: block.end()]}{block['indent']}{new}\n{text[block.end() :]}"


def write_line(source: Path, target: Path, key: str, values: Sequence[object]) -> None:
    """Write `with_line` of one file to another, or to the same; errors as of `with_line`, and OSError."""
    try:
        text = with_line(source.read_text(encoding="utf-8"), key, values)
    except ConfigError as error:
        raise ConfigError(f"{source}: {error}") from error
    write_whole({target: text.encode()})


def _without_comments(text: str) -> str:
    """The text with comments blanked, of the same length."""
    return re.sub(r"(^|\s)#[^\n]*", lambda match: match[1] + " " * (len(match[0]) - len(match[1])), text)
