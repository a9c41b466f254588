"""Memory that killed processes shared with others through Fast DDS: nobody gives it back, and /dev/shm fills.

Half a megabyte for each process (eProsima/Fast-DDS#2790). Its owner holds a lock on a file beside it for as long as it
lives, so that what nobody holds is nobody's.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import re
import time
from collections.abc import Iterator
from pathlib import Path

SHARED_MEMORY = Path("/dev/shm")
LOCK = re.compile(r"fastrtps_[0-9a-f]{16}_el")  # not of ports: several processes share one
YOUNG_S = 10.0  # who has just made a file may not have locked it yet


def give_back_abandoned_memory(folder: Path = SHARED_MEMORY) -> int:
    """Remove what processes of this user that are no more have left there.

    Args:
        folder: Where it lies.

    Returns:
        How many pieces were removed.
    """
    removed = 0
    for lock in _locks(folder):
        with _abandoned(lock) as abandoned, contextlib.suppress(OSError):  # a folder that may not be written
            if abandoned:
                lock.with_name(lock.name.removesuffix("_el")).unlink(missing_ok=True)
                lock.unlink(missing_ok=True)
                removed += 1
    return removed


def count_abandoned_memory(folder: Path = SHARED_MEMORY) -> int:
    """How many pieces `give_back_abandoned_memory` would remove."""
    count = 0
    for lock in _locks(folder):
        with _abandoned(lock) as abandoned:
            count += abandoned
    return count


@contextlib.contextmanager
def _abandoned(lock: Path) -> Iterator[bool]:
    """Whether a process of this user has left a piece of memory; nobody else takes it until the context ends."""
    with contextlib.ExitStack() as held:
        try:
            file = held.enter_context(lock.open())  # somebody else's, or gone meanwhile
            about = lock.stat()
            if about.st_uid == os.getuid() and time.time() - about.st_mtime >= YOUNG_S:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                mine = True
            else:
                mine = False
        except OSError:
            mine = False
        yield mine


def _locks(folder: Path) -> list[Path]:
    try:
        return [path for path in folder.iterdir() if LOCK.fullmatch(path.name)]
    except OSError:  # another system than Linux
        return []


if __name__ == "__main__":
    print(f"removed {give_back_abandoned_memory()} pieces of shared memory")  # noqa: T201 - a command of its own
