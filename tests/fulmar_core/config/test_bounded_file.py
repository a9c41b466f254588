"""Files from outside within bounds."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from fulmar_core.config.bounded_file import RefusedFileError, load_arrays, read_bounded


def test_a_file_within_its_bound_is_read(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(b"1234")
    assert read_bounded(tmp_path / "file", 4) == b"1234"


def test_a_larger_file_is_refused_with_its_size(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(b"12345")
    with pytest.raises(RefusedFileError, match="5 bytes, at most 4 are read"):
        read_bounded(tmp_path / "file", 4)


def test_a_pipe_is_refused_without_waiting_for_its_writer(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(RefusedFileError, match="no regular file"):
        read_bounded(tmp_path / "pipe", 4)


def test_a_device_is_refused() -> None:
    with pytest.raises(RefusedFileError, match="no regular file"):
        read_bounded(Path("/dev/zero"), 4)


def test_a_file_of_the_kernel_has_no_size_and_ends_at_the_bound() -> None:
    with pytest.raises(RefusedFileError, match="more than 4 bytes"):
        read_bounded(Path("/proc/self/status"), 4)


def test_arrays_that_unpack_beyond_the_bound_are_refused(tmp_path: Path) -> None:
    np.savez_compressed(tmp_path / "file.npz", zeros=np.zeros(100_000))
    assert load_arrays(tmp_path / "file.npz", 1_000_000)["zeros"].shape == (100_000,)
    with pytest.raises(ValueError, match="unpacks to 800"):
        load_arrays(tmp_path / "file.npz", 500_000)
