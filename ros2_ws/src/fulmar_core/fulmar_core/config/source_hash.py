"""Hashes of what a certified set was measured with: a robot's file, and the sources of the core."""

from __future__ import annotations

import functools
import hashlib
import json
from pathlib import Path
from typing import Any

from fulmar_core.config import yaml_text
from fulmar_core.config.paths import config_path

LOOKS = ("title", "look")  # keys of a robot's file that no episode depends on
# Folders of the core that an episode depends on: settings, messages and guards stand beside it.
EPISODES = (
    *("controllers", "dynamics", "estimators", "loop", "robots", "simulation", "states", "tasks", "worlds"),
)


def file_sha256(path: Path) -> str:
    """SHA-256 of a file's content."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def robot_sha256(robot: str) -> str:
    """SHA-256 of the values of a robot's file, by the robot's name; neither comments nor its looks count.

    Raises:
        ConfigError: There is no such robot.
    """
    values = yaml_text.load(config_path("robots", robot).read_text(encoding="utf-8"))
    kept = _with_text_keys({key: value for key, value in values.items() if key not in LOOKS})
    return hashlib.sha256(json.dumps(kept, sort_keys=True).encode()).hexdigest()


def _with_text_keys(value: Any) -> Any:
    """A value of YAML with keys of text: polynomials of aircraft have numbers among theirs, and JSON sorts one kind."""
    if isinstance(value, dict):
        return {str(key): _with_text_keys(each) for key, each in value.items()}
    return [_with_text_keys(each) for each in value] if isinstance(value, list) else value


@functools.cache
def core_sha256() -> str:
    """SHA-256 of the source files of `fulmar_core` that decide how an episode goes, by name and content."""
    folder, total = Path(__file__).resolve().parents[1], hashlib.sha256()
    for path in sorted(path for part in EPISODES for path in (folder / part).rglob("*.py")):
        total.update(str(path.relative_to(folder)).encode() + path.read_bytes())
    return total.hexdigest()
