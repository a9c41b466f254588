"""The page docs/keys.md: every key of the YAML files, made of the classes that read them.

`python -m tests.architecture.keys_page > docs/keys.md`
"""

from __future__ import annotations

import dataclasses
import inspect
import re
import sys
import types
import typing
from collections.abc import Iterator

from fulmar_bringup.fleet_file import Fleet
from fulmar_bringup.system import System
from fulmar_core.robots.robot import Robot
from fulmar_core.worlds.scenario import Scenario
from hardware_drivers.hardware import Hardware

ROOTS = {
    "Robots: `configs/robots`": Robot,
    "Scenarios: `configs/scenarios`": Scenario,
    "Systems: `configs/systems`": System,
    "Fleets: `configs/systems`, with `robots:`": Fleet,
    "Hardware: `configs/hardware`": Hardware,
}
INTRODUCTION = """\
# Keys of the YAML files

<!-- Generated from the classes that read them: python -m tests.architecture.keys_page > docs/keys.md -->

Files are strict: an unknown key is refused with the nearest known one, and so is a number that no robot has. Keys of
tasks stand on each task's page; `configs/` has commented files of all kinds. Keys without a default have to be there.
"""
COMMENT = re.compile(r"^\s*#\s?(.*)$")


def page() -> str:
    """Its text."""
    parts = [INTRODUCTION]
    for title, root in ROOTS.items():
        parts.append(f"\n## {title}\n\n| Key | Type | Default | |\n|---|---|---|---|\n")
        parts += [
            f"| `{key}` | {kind} | {default} | {words} |\n"
            for key, kind, default, words in _rows(root, "", ())
        ]
    return "".join(parts)


def _rows(owner: type, prefix: str, above: tuple[type, ...]) -> Iterator[tuple[str, str, str, str]]:
    """Key, type, default and comment of each field, those of nested classes after it."""
    comments, hints = _comments(owner), typing.get_type_hints(owner)
    for field in dataclasses.fields(owner):
        if not field.init:
            continue
        nested = _nested(hints[field.name])
        if nested is None:
            words = comments.get(field.name, "").replace("|", "\\|")
            if words.startswith("word:"):  # an old word, kept for files of users
                continue
            yield f"{prefix}{field.name}", _kind(field), _default(field), words
        elif nested not in above:
            yield from _rows(nested, f"{prefix}{field.name}.", (*above, owner))


def _nested(hint: object) -> type | None:
    """The one class with fields that a hint names, alone, optional or in a tuple."""
    named = [hint, *typing.get_args(hint)] if not isinstance(hint, type) else [hint]
    found = [each for each in named if isinstance(each, type) and dataclasses.is_dataclass(each)]
    return found[0] if len(found) == 1 else None


def _kind(field: dataclasses.Field[object]) -> str:
    text = field.type if isinstance(field.type, str) else getattr(field.type, "__name__", str(field.type))
    return "`" + text.replace("|", "or").replace("  ", " ") + "`"


def _default(field: dataclasses.Field[object]) -> str:
    if field.default is dataclasses.MISSING:
        return "" if field.default_factory is dataclasses.MISSING else "as its class"
    plain = isinstance(field.default, str | int | float | bool | types.NoneType) or field.default == ()
    return f"`{field.default!r}`" if plain else "as its class"


def _comments(owner: type) -> dict[str, str]:
    """Comment behind each field, or above it, as its class has it."""
    found: dict[str, str] = {}
    for base in reversed(owner.__mro__):
        if not dataclasses.is_dataclass(base):
            continue
        above: list[str] = []
        for line in inspect.getsource(base).splitlines():
            comment, field = COMMENT.match(line), re.match(r"^    (\w+): [^#]*(?:#\s*(.*))?$", line)
            if comment:
                above.append(comment[1])
                continue
            if field:
                found[field[1]] = field[2] or " ".join(above)
            above = []
    return found


if __name__ == "__main__":
    sys.stdout.write(page())
