"""The table of guards: files of `guards/`, one for each area.

A row is one check that keeps something from going wrong, how it is taken away, and the test that must fail then:

    name     one word, unique
    file     path in the repository
    text     part of the file, which stands there once; its first line may begin in the middle of one
    by       what takes its place
    breaks   what goes wrong without it
    test     pytest's name of the test: FILE::NAME
"""

from __future__ import annotations

import ast
import difflib
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import yaml

REPOSITORY = Path(__file__).resolve().parents[2]
FOLDER = Path(__file__).parent / "guards"


@dataclass(frozen=True)
class Guard:
    """One row."""

    area: str  # name of its file in `guards/`
    name: str
    file: str
    text: str
    by: str
    breaks: str
    test: str

    def problem(self, root: Path) -> str:
        """Why this guard cannot be taken away in a tree, with the nearest line; empty if it can."""
        path = root / self.file
        if not path.is_file():
            return f"{self.name}: there is no file {self.file}. Give the one that has the guard now."
        source = path.read_text(encoding="utf-8")
        count = source.count(self.text)
        if count != 1:
            begin = self.text.strip().split("\n")[0]
            return f"{self.name}: its text stands {count} times in {self.file}, must be once. {_nearest(begin, source)}"
        try:
            compile(self.removed(source), self.file, "exec") if path.suffix == ".py" else None
        except SyntaxError as error:
            return f"{self.name}: {self.file} is no Python without it, in line {error.lineno}: {error.msg}."
        file, _, name = self.test.partition("::")
        if name not in test_names(root / file):
            return f"{self.name}: there is no test {self.test}.{_near_test(name, test_names(root / file))}"
        return ""

    def removed(self, source: str) -> str:
        """A source without this guard."""
        return source.replace(self.text, self.by)


def read_guards(folder: Path = FOLDER) -> list[Guard]:
    """Rows of every file of a folder.

    Raises:
        TypeError: A row lacks a key, or has one of another name.
    """
    return [
        Guard(area=path.stem, **row)
        for path in sorted(folder.glob("*.yaml"))
        for row in yaml.load(
            path.read_text(encoding="utf-8"), Loader=yaml.CBaseLoader
        )  # every value is a text
    ]


@cache
def test_names(path: Path) -> frozenset[str]:
    """Names of the tests of a file as pytest writes them after the file's, found without importing it."""
    if not path.is_file():
        return frozenset()
    return frozenset(_names(ast.parse(path.read_text(encoding="utf-8")).body))


def _names(body: Iterable[ast.stmt], before: str = "") -> Iterable[str]:
    for node in body:
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and node.name.startswith("test"):
            yield before + node.name
        elif isinstance(node, ast.ClassDef):
            yield from _names(node.body, f"{before}{node.name}::")


def _nearest(text: str, source: str) -> str:
    """The line of a source that is most like the first one of a text, for a message."""
    lines = [line.strip() for line in source.splitlines()]
    near = difflib.get_close_matches(text, filter(None, lines), n=1, cutoff=0.4)
    return f"Nearest line, {lines.index(near[0]) + 1}: {near[0]}" if near else "No line of it is like it."


def _near_test(name: str, known: Iterable[str]) -> str:
    near = difflib.get_close_matches(name, known, n=1)
    return f" Nearest: {near[0]}." if near else ""
