"""Console output: results to stdout, everything else to stderr."""

from __future__ import annotations

import contextlib
import json
import logging
import os
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any, TextIO, TypeVar

from rich.console import Console
from rich.text import Text

if TYPE_CHECKING:
    from rich.table import Table

Result = TypeVar("Result", bound=dict[str, Any])

# What steers a terminal: everything of C0 and C1 but the end of a line and the tabulator.
_STEERS = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]")


def printable(text: str) -> str:
    """A text without the characters that steer a terminal: each stands as Python writes it.

    Names and descriptions come out of files and messages of strangers.
    """
    return _STEERS.sub(lambda found: repr(found[0])[1:-1], text)


class _PrintableConsole(Console):
    """A console that prints every text `printable`, also in tables."""

    def render_str(self, text: str, **options: Any) -> Text:
        return super().render_str(printable(text), **options)


# Without emoji: `robot.yaml:100: ...` would come out with a symbol in place of its line.
console = _PrintableConsole(stderr=True, highlight=False, emoji=False)
output = _PrintableConsole(highlight=False, emoji=False)


_results: list[TextIO] = []  # where JSON goes while standard output is kept free of all else


@contextlib.contextmanager
def json_alone() -> Iterator[bool]:
    """Keep standard output for `print_json`: what classes of users, libraries and workers print goes to the error.

    Yields:
        True, for the flag that asks for it.
    """
    shown = sys.stdout
    with contextlib.ExitStack() as ending:
        if _is_descriptor(shown, 1):  # else it was replaced, by a test
            shown.flush()
            results: TextIO = os.fdopen(os.dup(1), "w", encoding=shown.encoding, errors=shown.errors)
            ending.callback(_close, results)
            os.dup2(2, 1)
            ending.callback(os.dup2, results.fileno(), 1)
            ending.callback(shown.flush)
        else:
            results = shown
        ending.enter_context(contextlib.redirect_stdout(sys.stderr))
        _results.append(results)
        ending.callback(_results.pop)
        yield True


def _is_descriptor(stream: TextIO, number: int) -> bool:
    try:
        return stream.fileno() == number
    except (OSError, ValueError):
        return False


def _close(stream: TextIO) -> None:
    with contextlib.suppress(OSError):  # its reader has ended, which was said before
        stream.close()


def print_json(value: dict[str, Any], *, indent: int | None = 2) -> None:
    """Print one JSON object and nothing else."""
    stream = _results[-1] if _results else sys.stdout
    stream.write(json.dumps(value, indent=indent, allow_nan=False) + "\n")
    stream.flush()


def print_result(result: Result, show: Callable[[Result], None], *, as_json: bool) -> None:
    """Print a result as one JSON object, or with `show` for people."""
    if as_json:
        print_json(result)
    else:
        show(result)


def write_line(text: object) -> None:
    """Print one line of a result; it is not folded, so that other programs can read it."""
    output.print(str(text), markup=False, soft_wrap=True)


def log_line(text: str) -> None:
    """Print one line beside the result."""
    console.print(text, markup=False, soft_wrap=True)


def warn(lines: Iterable[str]) -> None:
    """Print one warning a line beside the result."""
    for line in lines:
        log_line(f"warning: {line}")


def new_table(title: str, texts: Sequence[str], numbers: Sequence[str]) -> Table:
    """Make a table with columns of text to the left and columns of numbers, aligned right, after them."""
    from rich.table import Table

    table = Table(title=title)
    for column in texts:
        table.add_column(column)
    for column in numbers:
        table.add_column(column, justify="right")
    return table


class _Shown(logging.Handler):
    """Prints each warning once: the same file is loaded several times."""

    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self._said: set[str] = set()

    def emit(self, record: logging.LogRecord) -> None:
        message = record.getMessage()
        if message not in self._said:
            self._said.add(message)
            warn([message])


@contextlib.contextmanager
def showing_warnings() -> Iterator[None]:
    """Print the warnings of the core, such as of unusual configuration values, to standard error."""
    logger, handler = logging.getLogger("fulmar_core"), _Shown()
    logger.addHandler(handler)
    try:
        yield
    finally:
        logger.removeHandler(handler)
