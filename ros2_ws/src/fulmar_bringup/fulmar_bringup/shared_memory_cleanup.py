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
        with contextlib.suppress(OSError), lock.open() as held:  # somebody else's, or gone meanwhile
            about = lock.stat()
            if about.st_uid != os.getuid() or time.time() - about.st_mtime < YOUNG_S:
                continue
            fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
            lock.with_name(lock.name.removesuffix("_el")).unlink(missing_ok=True)
            lock.unlink(missing_ok=True)
            removed += 1
    return removed


def _locks(folder: Path) -> list[Path]:
    try:
        return [path for path in folder.iterdir() if LOCK.fullmatch(path.name)]
    except OSError:  # another system than Linux
        return []
