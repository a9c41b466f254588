"""Files of shipped robots with one key changed, and the sentence that a wrong one is refused with."""

from __future__ import annotations

import copy
import functools
import json
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from fulmar_core.config.paths import config_path
from fulmar_core.config.yaml_text import load

RANGE = re.compile(
    r"accepted is|at most|must be|at least|must lie|must not be|no body has|which does not hold"
)


@functools.cache
def _shipped(name: str) -> Any:
    return load(config_path("robots", name).read_text(encoding="utf-8"))


def times(factor: float) -> Callable[[float], float]:
    """The value times a factor; -1 is the other sign."""
    return lambda value: factor * value


def altered(folder: Path, name: str, changes: Mapping[str, Any]) -> tuple[Path, str]:
    """A shipped robot's file with other values.

    Args:
        folder: To write it into.
        name: Of the robot.
        changes: By dotted key; a function is given the value that is there.

    Returns:
        The file, and the last value as messages write it.
    """
    robot, value = copy.deepcopy(_shipped(name)), None
    for key, value in changes.items():
        *parts, last = key.split(".")
        inner = robot
        for part in parts:
            inner = inner[int(part) if isinstance(inner, list) else part]
        place: Any = int(last) if isinstance(inner, list) or last.isdigit() else last
        value = inner[place] = value(inner[place]) if callable(value) else value
    path = folder / f"{name}.yaml"
    path.write_text(json.dumps(robot, indent=1, ensure_ascii=False), encoding="utf-8")
    return path, f"{value:g}" if isinstance(value, float) else str(value)


def assert_names(message: str, key: str, value: str) -> None:
    """A message is one line with the key, or the end of it, the value and what is allowed."""
    assert "\n" not in message
    parts = key.split(".")
    assert any(f"'{'.'.join(parts[i:])}'" in message for i in range(len(parts))), message
    assert value in message, message
    assert RANGE.search(message), message
