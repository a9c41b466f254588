"""Tests read files that Fulmar comes with once; others, changed ones and refused ones each time."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from fulmar_core.robots.robot_file import load_robot
from tests import read_once
from tests.read_once import once


@pytest.fixture
def shipped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A file in the place of those that Fulmar comes with."""
    monkeypatch.setattr(read_once, "config_directory", lambda: tmp_path / "configs")
    (tmp_path / "configs").mkdir()
    (tmp_path / "configs" / "it.yaml").write_text("one")
    return tmp_path / "configs" / "it.yaml"


def test_a_shipped_robot_is_the_same_object_again() -> None:
    assert load_robot("kingfisher") is load_robot("kingfisher")


def test_a_file_is_read_once_for_each_type_and_again_once_it_has_changed(shipped: Path) -> None:
    read: list[type] = []

    def reading(kind: type, path: Path) -> str:
        read.append(kind)
        return path.read_text()

    reader = once(reading)
    assert [reader(kind, shipped) for kind in (int, int, str)] == ["one"] * 3
    assert read == [int, str]
    shipped.write_text("two")
    os.utime(shipped, ns=(1, 1))
    assert reader(int, shipped) == "two"


def test_files_of_tests_are_read_each_time_and_what_is_refused_is_refused_again(shipped: Path) -> None:
    own = shipped.parents[1] / "own.yaml"
    own.write_text("mine")
    read: list[Path] = []
    reader = once(lambda path: read.append(path))
    reader(own)
    reader(own)
    assert read == [own, own]

    def refusing(path: Path) -> None:
        read.append(path)
        raise ValueError("no")

    refused = once(refusing)
    for _ in range(2):
        with pytest.raises(ValueError, match="no"):
            refused(shipped)
    assert read == [own, own, shipped, shipped]
