"""ROS domains that nobody else on this machine uses, for work that must not be mixed with anybody's."""

from __future__ import annotations

import contextlib
import fcntl
import os
import random
import tempfile
from collections.abc import Iterator
from pathlib import Path

from fulmar_core.errors import ConfigError

DOMAINS = range(1, 102)  # up to 101 the ports of a domain lie below those that Linux hands out to others


@contextlib.contextmanager
def reserved_domains(count: int) -> Iterator[list[int]]:
    """Reserve domains until the context ends.

    A lock file for each keeps processes of this user apart; it goes with the process, however that ends.

    Args:
        count: How many, >= 1.

    Yields:
        Domain ids.

    Raises:
        ConfigError: If so many are not free.
    """
    folder = Path(tempfile.gettempdir()) / f"fulmar_ros_domains_{os.getuid()}"
    folder.mkdir(exist_ok=True)
    reserved: list[int] = []
    with contextlib.ExitStack() as locks:
        for domain in random.sample(DOMAINS, len(DOMAINS)):
            if len(reserved) == count:
                break
            lock = locks.enter_context((folder / str(domain)).open("w"))
            with contextlib.suppress(BlockingIOError):
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                reserved.append(domain)
        if len(reserved) < count:
            raise ConfigError(
                f"{count} free ROS domains are needed, {len(reserved)} were found. Use fewer --jobs."
            )
        yield reserved
