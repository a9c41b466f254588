"""Answers of `fulmar` where extras are missing: one process imports it once, and forks once per command.

Standard input has a list of questions as JSON, each a command line and the extras that are missing; standard output
gets the exit code and the text of each.
"""

from __future__ import annotations

import contextlib
import gc
import importlib
import json
import os
import pkgutil
import sys
from collections.abc import Sequence
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any

import typer

from fulmar_cli import main
from fulmar_cli.installation.extras import EXTRAS

PACKAGES = (
    "fulmar_core", "fulmar_bags", "fulmar_ros", "fulmar_bringup", "fulmar_evaluation", "fulmar_benchmarks",
    "fulmar_cli", "fulmar_console", "sim_nodes", "policy_server", "hardware_drivers", "training",
)  # fmt: skip
missing: set[str] = set()


class Without:
    """A finder of modules that does not find the missing ones."""

    def __init__(self, finder: Any) -> None:
        self._finder = finder

    def find_spec(
        self, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Where a module is; None if it is missing."""
        if name.partition(".")[0] in missing:
            return None
        return self._finder.find_spec(name, path, target)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._finder, name)


def import_what_needs_no_extra() -> None:
    """Import every module of Fulmar that can be without extras, so that a fork need not."""
    missing.update(module for modules in EXTRAS.values() for module in modules)
    for package in PACKAGES:
        folders = importlib.import_module(package).__path__
        for found in pkgutil.walk_packages(folders, f"{package}.", onerror=lambda _: None):
            with contextlib.suppress(ImportError):
                importlib.import_module(found.name)
    main.app = typer.main.get_command(main.app)  # typer would build it anew for each command
    gc.freeze()


def answer(words: list[str], without: list[str]) -> tuple[int, str]:
    """Exit code and text of a command where some extras are missing; a traceback is among the text."""
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reader)
        os.dup2(writer, 1)
        os.dup2(writer, 2)
        missing.clear()
        missing.update(module for extra in without for module in EXTRAS[extra])
        sys.argv = ["fulmar", *words]
        try:
            main.main()  # an error other than this ends the child with its traceback
        except SystemExit as ended:
            sys.stdout.flush()
            os._exit(int(ended.code or 0))  # Python would free all modules first
    os.close(writer)
    with os.fdopen(reader) as pipe:
        text = pipe.read()
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), text


if __name__ == "__main__":
    sys.meta_path[:] = [Without(finder) for finder in sys.meta_path]
    import_what_needs_no_extra()
    asked = json.load(sys.stdin)
    print(json.dumps([answer(*question) for question in asked]))  # noqa: T201
