"""Console output: results to standard output, everything else to standard error."""

from __future__ import annotations

import contextlib
import json
import logging
import sys
from collections.abc import Iterator
from typing import Any

from rich.console import Console

# Without emoji: `robot.yaml:100: ...` would come out with a picture in the place of its line.
console = Console(stderr=True, highlight=False, emoji=False)
output = Console(highlight=False, emoji=False)


def print_json(value: dict[str, Any]) -> None:
    """Print one JSON object and nothing else."""
    sys.stdout.write(json.dumps(value, indent=2, allow_nan=False) + "\n")


class _Shown(logging.Handler):
    """Prints each warning once: the same file is loaded several times."""

    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self._said: set[str] = set()

    def emit(self, record: logging.LogRecord) -> None:
        message = record.getMessage()
        if message not in self._said:
            self._said.add(message)
            console.print(f"warning: {message}", markup=False, soft_wrap=True)


@contextlib.contextmanager
def showing_warnings() -> Iterator[None]:
    """Print the warnings of the core, such as of unusual configuration values, to standard error."""
    logger, handler = logging.getLogger("fulmar_core"), _Shown()
    logger.addHandler(handler)
    try:
        yield
    finally:
        logger.removeHandler(handler)
