"""Recorded runs to read, written once, and the command line."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from fulmar_bringup import cli
from tests.fulmar_bringup.bag_commands import POLICY
from tests.fulmar_bringup.synthetic_run import CALM, Plan, write_run


@pytest.fixture(scope="session")
def reached(tmp_path_factory) -> Path:
    """A run that reached its goal."""
    return write_run(tmp_path_factory.mktemp("runs") / "reached", Plan())


@pytest.fixture(scope="session")
def calm(tmp_path_factory) -> Path:
    """The same way with other gains, under the name of a policy."""
    return write_run(tmp_path_factory.mktemp("runs") / "calm", Plan(controller="policy", weights=CALM))


@pytest.fixture(scope="session")
def silenced(tmp_path_factory) -> Path:
    """A run whose controller fell silent and did not come back."""
    return write_run(
        tmp_path_factory.mktemp("runs") / "silenced", Plan(duration_s=15.0, silence_s=(8.0, 15.1))
    )


@pytest.fixture
def copy_of(tmp_path) -> Callable[[Path], Path]:
    """Copies of bags, to be damaged."""

    def copy(bag: Path) -> Path:
        return Path(shutil.copytree(bag, tmp_path / bag.name))

    return copy


@pytest.fixture
def copy(tmp_path) -> Path:
    """A copy of a reference bag, to be changed or damaged."""
    return Path(shutil.copytree(POLICY, tmp_path / "bag"))


@pytest.fixture
def fulmar(monkeypatch, capsys):
    """Run a command line in this process: exit code, standard output, standard error."""

    def call(*words: object) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["fulmar", *map(str, words)])
        with pytest.raises(SystemExit) as ended:
            cli.main()
        captured = capsys.readouterr()
        return int(ended.value.code or 0), captured.out, captured.err

    return call
