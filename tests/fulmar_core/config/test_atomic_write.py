"""Files that replace others only when all of them are complete."""

from __future__ import annotations

import errno

import pytest

from fulmar_core.config import atomic_write
from fulmar_core.config.atomic_write import whole_file, write_whole


def full_at(number, monkeypatch):
    """Let the disk be full when so many files have been written."""
    done = []

    def settle(file):
        done.append(file)
        if len(done) > number:
            raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(atomic_write, "_settle", settle)


def test_files_are_replaced_and_nothing_else_is_left(tmp_path):
    (tmp_path / "a").write_text("old")
    write_whole({tmp_path / "a": b"new", tmp_path / "b": b"too"})
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"a": "new", "b": "too"}


@pytest.mark.parametrize("number", [0, 1])
def test_where_one_has_no_room_all_stay_as_they_were_and_it_is_named(tmp_path, monkeypatch, number):
    for name in "ab":
        (tmp_path / name).write_text("old")
    full_at(number, monkeypatch)
    with pytest.raises(OSError, match="No space left") as caught:
        write_whole({tmp_path / "a": b"new", tmp_path / "b": b"new"})
    assert caught.value.filename == str(tmp_path / "ab"[number])
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"a": "old", "b": "old"}


def test_a_file_whose_writer_fails_is_not_replaced(tmp_path):
    (tmp_path / "a").write_text("old")
    with pytest.raises(ValueError, match="no more"), whole_file(tmp_path / "a") as file:
        file.write(b"half")
        raise ValueError("no more")
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [("a", "old")]
