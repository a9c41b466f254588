"""The page docs/all_commands.md: every command with its `--help`, made of the command line itself.

`python -m tests.architecture.commands_page > docs/all_commands.md`
"""

from __future__ import annotations

import sys
from collections.abc import Iterator

import typer
import typer.main
from typer.testing import CliRunner

from fulmar_cli.main import app

COLUMNS = 100  # of the help, as in a wide terminal
INTRODUCTION = """\
# All commands

<!-- Generated from the command line: python -m tests.architecture.commands_page > docs/all_commands.md -->

What `--help` prints of each command, in the order of `fulmar --help`. [Commands by purpose](commands.md) has examples.
"""


def page() -> str:
    """Its text."""
    return INTRODUCTION + "".join(
        f"\n{'#' * level} {' '.join(words)}\n\n```text\n{_help(words)}\n```\n" for level, words in _commands()
    )


def _commands() -> Iterator[tuple[int, tuple[str, ...]]]:
    """Level of the heading and words of each command; commands of a group come after it."""
    root = typer.main.get_command(app)
    for name, command in root.commands.items():  # type: ignore[attr-defined]
        yield 2, ("fulmar", name)
        for inner in getattr(command, "commands", {}):
            yield 3, ("fulmar", name, inner)


def _help(words: tuple[str, ...]) -> str:
    settings = {"prog_name": "fulmar", "terminal_width": COLUMNS, "max_content_width": COLUMNS}
    result = CliRunner().invoke(app, [*words[1:], "--help"], **settings)  # type: ignore[arg-type]
    lines = (line.rstrip() for line in result.stdout.strip().splitlines())
    return "\n".join(lines)


if __name__ == "__main__":
    sys.stdout.write(page())
