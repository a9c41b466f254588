"""The README is true: its commands exist, its links lead somewhere, its table of wires is the table in the code."""

from __future__ import annotations

import re
import shlex

import pytest
import typer.main

from fulmar_cli.main import app
from fulmar_core.topics import WIRES

COMMAND = re.compile(r"^(fulmar .*)$", re.MULTILINE)


@pytest.fixture
def readme(repository) -> str:
    return (repository / "README.md").read_text(encoding="utf-8")


def options_of(command) -> set[str]:
    return {name for parameter in command.params for name in parameter.opts} | {"--help"}


def test_every_fulmar_command_in_the_readme_exists_with_its_options(readme):
    root = typer.main.get_command(app)
    lines = COMMAND.findall(readme)
    assert len(lines) >= 5
    for line in lines:
        words = shlex.split(line, comments=True)[1:]
        command = root
        while words and hasattr(command, "commands"):
            assert words[0] in command.commands, line
            command = command.commands[words.pop(0)]
        asked = {word for word in words if word.startswith("--")}
        assert asked <= options_of(command), line


def test_every_inline_command_names_a_real_subcommand(readme):
    commands = typer.main.get_command(app).commands
    named = re.findall(r"`fulmar ([a-z]+)", readme)
    assert named
    assert set(named) <= set(commands)


def test_every_make_target_in_the_readme_exists(readme, repository):
    targets = set(
        re.findall(r"^([a-z-]+):", (repository / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)
    )
    assert set(re.findall(r"make ([a-z-]+)", readme)) <= targets | {"a"}


def test_every_file_the_readme_links_to_exists_and_is_small(readme, repository):
    links = re.findall(r"\]\(([^)#:]+)\)", readme)
    assert "docs/demo.png" in links
    for link in links:
        assert (repository / link).stat().st_size < 500_000, link


def test_the_readme_lists_every_wire_as_the_code_defines_it(readme):
    for wire in WIRES:
        assert (
            f"| `{wire.name}` | {wire.type.replace('/msg/', '/')} | {wire.source} | {wire.content} |"
            in readme
        )


def test_every_folder_the_readme_names_exists(readme, repository):
    folders = re.findall(r"^\| `([a-z_0-9/]+/)` \|", readme, re.MULTILINE)
    assert len(folders) >= 8
    assert all((repository / folder).is_dir() for folder in folders)
