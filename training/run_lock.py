"""One training at a time in a run folder."""

from __future__ import annotations

import contextlib
import fcntl
from collections.abc import Iterator
from pathlib import Path

from fulmar_core.errors import ConfigError

LOCK_FILE = "learning.lock"


@contextlib.contextmanager
def learning_in(run: Path) -> Iterator[None]:
    """Keep others out of a run folder until the context ends; the lock goes with the process, however that ends.

    Args:
        run: Made if need be.

    Raises:
        ConfigError: Somebody else learns there.
    """
    run.mkdir(parents=True, exist_ok=True)
    path = run / LOCK_FILE
    with path.open("w") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise ConfigError(
                f"{run}: another `fulmar train` is learning there. Give --out another folder."
            ) from None
        try:
            yield
        finally:
            path.unlink(missing_ok=True)
