"""Shared memory that other users of the computer cannot read.

Fast DDS gives its segments mode 0644 whatever the umask is, and every message of a node lies in its segment.
"""

from __future__ import annotations

import contextlib
import os
from pathlib import Path

MAPS = Path("/proc/self/maps")  # a line for each mapping of this process, a file's path behind five columns
SEGMENTS = "/dev/shm/fastrtps_"
PRIVATE = 0o077  # rights that group and others do not get


def keep_memory_private() -> None:
    """Take the rights of group and others from what this process shares with other nodes.

    To be called once the participant of this process is there, which creates its segment with the first node.
    """
    for path in _segments():
        with contextlib.suppress(OSError):  # another node has ended meanwhile
            found = os.stat(path)
            if found.st_uid == os.geteuid() and found.st_mode & PRIVATE:
                os.chmod(path, found.st_mode & 0o777 & ~PRIVATE)


def _segments() -> set[str]:
    try:
        lines = MAPS.read_text().splitlines()
    except OSError:  # no Linux: another middleware, or none
        return set()
    paths = {line.split(maxsplit=5)[-1] for line in lines if SEGMENTS in line}
    return {path for path in paths if path.startswith(SEGMENTS)}
