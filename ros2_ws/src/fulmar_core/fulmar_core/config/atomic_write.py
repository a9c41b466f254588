"""Atomic writes: a file is complete or absent, whatever happens while it is written."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import BinaryIO


def write_whole(contents: Mapping[Path, bytes]) -> None:
    """Write files into existing folders; files of the same names are replaced only when all new ones are complete.

    Raises:
        OSError: A file could not be written, with its name; nothing of it is left, and what was there stays.
    """
    with contextlib.ExitStack() as all_of_them:
        for path, content in contents.items():
            file = all_of_them.enter_context(whole_file(path))
            file.write(content)
            _settle(file)  # here, since none may take its place before all are complete


@contextlib.contextmanager
def whole_file(path: Path) -> Iterator[BinaryIO]:
    """Open one such file for writing until the context ends; errors as in `write_whole`."""
    new = path.with_name(f".{path.name}.{os.getpid()}.new")  # of each process its own, should two write it
    try:
        with _named(path), new.open("wb") as file:
            yield file
            _settle(file)
        new.replace(path)
        sync_folder(path.parent)
    finally:
        new.unlink(missing_ok=True)


def sync_folder(folder: Path) -> None:
    """Bring the names in a folder to the disk: until then a new name is lost with the power.

    Raises:
        OSError: The disk refuses.
    """
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _settle(file: BinaryIO) -> None:
    file.flush()
    os.fsync(file.fileno())


@contextlib.contextmanager
def _named(path: Path) -> Iterator[None]:
    """Errors of a full disk name no file by themselves."""
    try:
        yield
    except OSError as error:
        if error.filename:
            raise
        raise OSError(error.errno, error.strerror, str(path)) from error
