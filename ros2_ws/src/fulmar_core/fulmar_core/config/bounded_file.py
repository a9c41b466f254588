"""Files from outside, read within bounds: regular files, of a size that their kind can have, without waiting.

A pipe would hold up its reader for ever, a device has no end, and a few kilobytes can unpack to gigabytes.
"""

from __future__ import annotations

import errno
import io
import os
import stat
import zipfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

import numpy as np

KEY_BYTES = 100_000  # keys and signatures
CONFIG_BYTES = 1_000_000  # what people write, and reports of a run that are as short
RECORD_BYTES = 2_000_000  # `metadata.yaml` of a bag: some ten thousand files
WEIGHTS_BYTES = 50_000_000  # networks and golden vectors
IMPORTED_BYTES = 200_000_000  # checkpoints of other stacks, which hold an optimiser beside the weights
CATALOGUE_BYTES = 100_000_000  # of stars
ENDLESS = 1 << 62  # for bags and recordings, which are read piece by piece


class RefusedFileError(OSError):
    """A file is none that is read here; `strerror` says why."""


@contextmanager
def bounded_file(path: Path, most: int) -> Iterator[BinaryIO]:
    """Open a file for reading.

    Args:
        path: A regular file, or a link to one.
        most: So large it may be [bytes].

    Raises:
        RefusedFileError: It is a pipe, a device or a socket, or it is larger.
        OSError: It cannot be opened.
    """
    # A pipe without a writer would otherwise be waited for.
    descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    with os.fdopen(descriptor, "rb") as file:
        about = os.fstat(descriptor)
        if stat.S_ISDIR(about.st_mode):
            raise RefusedFileError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
        if not stat.S_ISREG(about.st_mode):
            raise RefusedFileError(errno.EINVAL, "it is no regular file", str(path))
        if about.st_size > most:
            raise RefusedFileError(errno.EFBIG, f"{about.st_size} bytes, at most {most} are read", str(path))
        yield file


def read_bounded(path: Path, most: int) -> bytes:
    """Read a whole file; arguments and errors as in `bounded_file`."""
    with bounded_file(path, most) as file:
        content = file.read(most + 1)
    if len(content) > most:  # files of the kernel have no size
        raise RefusedFileError(errno.EFBIG, f"more than {most} bytes, at most these are read", str(path))
    return content


def check_unpacked(content: bytes, most: int) -> None:
    """Refuse a zip archive whose files together are larger than `most` bytes.

    Raises:
        ValueError: They are, or it is no zip archive.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            unpacked = sum(entry.file_size for entry in archive.infolist())
    # NotImplementedError is zipfile's for a version or a compression that it does not know.
    except (zipfile.BadZipFile, NotImplementedError, UnicodeDecodeError) as error:
        raise ValueError(f"is no archive, or a damaged one ({type(error).__name__})") from error
    if unpacked > most:
        raise ValueError(f"unpacks to {unpacked} bytes, at most {most} are read")


def load_arrays(
    source: Path | bytes, most: int = WEIGHTS_BYTES, *, names: Sequence[str] | None = None
) -> dict[str, np.ndarray]:
    """Arrays of an `.npz` by name; no Python object is loaded.

    Args:
        source: The file, or its content.
        most: So large it and its arrays together may be [bytes].
        names: Which arrays; all by default.

    Raises:
        RefusedFileError: As in `bounded_file`.
        OSError: It cannot be opened.
        ValueError: It is no such file, it lacks an array, it is damaged, or its arrays are larger.
    """
    content = source if isinstance(source, bytes) else read_bounded(source, most)
    try:
        check_unpacked(content, most)
        with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
            return {name: np.asarray(arrays[name]) for name in (arrays.files if names is None else names)}
    except KeyError as error:
        raise ValueError(f"lacks an array: {error.args[0] if error.args else error}") from error
    # What zipfile and NumPy raise for headers that lie; NotImplementedError is zipfile's for an unknown compression.
    except (zipfile.BadZipFile, EOFError, SyntaxError, TypeError, RuntimeError) as error:
        raise ValueError(f"is no .npz file, or a damaged one ({type(error).__name__})") from error
    except (MemoryError, NotImplementedError, OverflowError, OSError) as error:
        raise ValueError(f"is damaged ({type(error).__name__})") from error
