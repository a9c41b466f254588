"""Modules of a user's own in a folder outside the checkout, that the test's process works in; those of the pages."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
import yaml

from fulmar_core.config.paths import config_path

DOCS = Path(__file__).resolve().parents[1] / "docs"


@contextmanager
def own_folder(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Work in a folder; its modules are forgotten afterwards."""
    monkeypatch.chdir(folder)
    monkeypatch.setattr(sys, "path", list(sys.path))
    before = set(sys.modules)
    yield folder
    for name in set(sys.modules) - before:
        file = getattr(sys.modules[name], "__file__", None)
        if file and Path(file).is_relative_to(folder):
            del sys.modules[name]


def blocks(page: str, language: str) -> list[str]:
    """Blocks of code of a page, as a user copies them."""
    text = (DOCS / page).read_text(encoding="utf-8")
    return re.findall(rf"```{language}\n(.*?)```", text, re.DOTALL)


def write_sentry(folder: Path, base: str = "turtlebot2") -> str:
    """Write the sensor and the controller of the page about sensors, and 'sentry', a robot that has the sensor.

    Returns:
        Folder of the configuration files.
    """
    for name, code in zip(("my_sensor.py", "my_control.py"), blocks("own-sensor.md", "python"), strict=True):
        (folder / name).write_text(code)
    (own,) = blocks("own-sensor.md", "yaml")
    robot = yaml.safe_load(config_path("robots", base).read_text(encoding="utf-8"))
    robot["sensors"] |= yaml.safe_load(own)["sensors"]
    (folder / "mine" / "robots").mkdir(parents=True)
    (folder / "mine" / "robots" / "sentry.yaml").write_text(yaml.safe_dump(robot | {"name": "sentry"}))
    return str(folder / "mine")
