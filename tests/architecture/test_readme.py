"""README: short, with commands, links and folders that exist."""

from __future__ import annotations

import re
import shlex

import pytest
import typer.main

from fulmar_cli.main import app

COMMAND = re.compile(r"^(fulmar .*)$", re.MULTILINE)


@pytest.fixture
def readme(repository) -> str:
    return (repository / "README.md").read_text(encoding="utf-8")


def test_length_is_under_120_lines(readme):
    assert len(readme.splitlines()) < 120


def options_of(command) -> set[str]:
    return {name for parameter in command.params for name in parameter.opts} | {"--help"}


def test_commands_exist_with_their_options(readme):
    root = typer.main.get_command(app)
    lines = COMMAND.findall(readme)
    assert len(lines) >= 4
    for line in lines:
        words = shlex.split(line, comments=True)[1:]
        command = root
        while words and hasattr(command, "commands"):
            assert words[0] in command.commands, line
            command = command.commands[words.pop(0)]
        asked = {word for word in words if word.startswith("--")}
        assert asked <= options_of(command), line


def test_inline_commands_exist(readme):
    commands = typer.main.get_command(app).commands
    named = re.findall(r"`fulmar ([a-z]+)", readme)
    assert named
    assert set(named) <= set(commands)


def test_make_targets_exist(readme, repository):
    targets = set(
        re.findall(r"^([a-z-]+):", (repository / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)
    )
    assert set(re.findall(r"make ([a-z-]+)", readme)) <= targets | {"a"}


def test_linked_files_exist_and_are_small(readme, repository):
    links = re.findall(r"\]\(([^)#:]+)\)", readme)
    assert "docs/pictures/demo.png" in links
    for link in links:
        assert (repository / link).stat().st_size < 500_000, link


def test_folders_exist(readme, repository):
    folders = re.findall(r"^\| `([a-z_0-9/]+/)` \|", readme, re.MULTILINE)
    assert len(folders) >= 8
    assert all((repository / folder).is_dir() for folder in folders)
