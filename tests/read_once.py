"""Files that Fulmar comes with are read once in a process of tests, which would read them thousands of times."""

from __future__ import annotations

import functools
import importlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from fulmar_core.config.paths import config_directory

# Where they are read: module and function, whose last argument is the file's path.
READERS = (
    ("fulmar_core.robots.robot_file", "load_robot_file"),
    ("fulmar_core.tasks", "load_config"),
    ("fulmar_core.tasks.goal_files", "load_config"),
    ("fulmar_core.worlds.scenario", "load_config"),
    ("fulmar_core.worlds.structures", "load_config"),
    ("hardware_drivers.hardware", "load_config"),
)


def once(read: Callable[..., Any]) -> Callable[..., Any]:
    """Keep what a function makes of a file that Fulmar comes with, until the file changes.

    Files of a test are read each time, and so are those that are refused.

    Args:
        read: Takes a path last, and returns what no test changes.
    """

    @functools.cache
    def kept(*given: Any, changed_ns: int) -> Any:
        return read(*given)

    @functools.wraps(read)
    def reader(*given: Any) -> Any:
        path = Path(given[-1]).absolute()
        if not path.is_relative_to(config_directory()):
            return read(*given)
        return kept(*given[:-1], path, changed_ns=path.stat().st_mtime_ns)

    return reader


def read_once(patch: pytest.MonkeyPatch) -> None:
    """Let the readers keep what they have read."""
    for module, name in READERS:
        found = importlib.import_module(module)
        patch.setattr(found, name, once(getattr(found, name)))
