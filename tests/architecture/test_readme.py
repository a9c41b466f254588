"""README: short, with make targets and folders that exist; test_docs.py checks its commands and links."""

from __future__ import annotations

import re

import pytest


@pytest.fixture
def readme(repository) -> str:
    return (repository / "README.md").read_text(encoding="utf-8")


def test_length_is_under_120_lines(readme):
    assert len(readme.splitlines()) < 120


def test_make_targets_exist(readme, repository):
    makefile = (repository / "Makefile").read_text(encoding="utf-8")
    assert set(re.findall(r"make ([a-z-]+)", readme)) <= set(
        re.findall(r"^([a-z-]+):", makefile, re.MULTILINE)
    )


def test_folders_exist(readme, repository):
    folders = re.findall(r"^\| `([a-z_0-9/]+/)` \|", readme, re.MULTILINE)
    assert len(folders) >= 8
    assert all((repository / folder).is_dir() for folder in folders)
