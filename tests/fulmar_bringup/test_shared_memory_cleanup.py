"""What killed processes leave in shared memory is given back, and nothing else."""

from __future__ import annotations

import fcntl
import os
import time
from pathlib import Path

from fulmar_bringup.shared_memory_cleanup import give_back_abandoned_memory

SEGMENT, PORT = "fastrtps_0123456789abcdef", "fastrtps_port7411"


def left(folder, *names, age_s=60.0):
    then = time.time() - age_s
    for name in names:
        (folder / name).write_bytes(b"x")
        os.utime(folder / name, (then, then))


def test_what_nobody_holds_is_given_back_with_all_that_belongs_to_it(tmp_path):
    left(tmp_path, SEGMENT, f"{SEGMENT}_el")
    assert give_back_abandoned_memory(tmp_path) == 1
    assert not list(tmp_path.iterdir())


def test_what_a_living_process_holds_stays(tmp_path):
    left(tmp_path, SEGMENT, f"{SEGMENT}_el")
    with (tmp_path / f"{SEGMENT}_el").open() as held:
        fcntl.flock(held, fcntl.LOCK_EX)
        assert give_back_abandoned_memory(tmp_path) == 0
    assert (tmp_path / SEGMENT).exists()


def test_what_has_just_been_made_and_what_others_made_stays(tmp_path):
    left(tmp_path, SEGMENT, f"{SEGMENT}_el", age_s=0.0)
    left(tmp_path, "sem.mp-abcdefgh", "fastrtps_notes_el", "psm_01234567", PORT, f"{PORT}_el")
    assert give_back_abandoned_memory(tmp_path) == 0
    assert len(list(tmp_path.iterdir())) == 7


def test_what_another_user_left_stays(tmp_path, monkeypatch):
    """Also where we are root and could remove it."""
    left(tmp_path, SEGMENT, f"{SEGMENT}_el")
    stranger = os.getuid() + 1
    monkeypatch.setattr(os, "getuid", lambda: stranger)
    assert give_back_abandoned_memory(tmp_path) == 0
    assert (tmp_path / SEGMENT).exists()


def test_where_there_is_none_nothing_happens(tmp_path):
    assert give_back_abandoned_memory(tmp_path / "none") == 0


def test_memory_that_may_not_be_removed_stays_without_an_error(tmp_path, monkeypatch):
    left(tmp_path, SEGMENT, f"{SEGMENT}_el")

    def refuse(_path, **_):
        raise PermissionError

    monkeypatch.setattr(Path, "unlink", refuse)
    assert give_back_abandoned_memory(tmp_path) == 0
