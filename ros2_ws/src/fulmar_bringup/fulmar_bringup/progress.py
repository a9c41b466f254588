"""A bar for long work counted in control steps, on standard error, only on a terminal."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator

from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from fulmar_bringup.console import console


@contextlib.contextmanager
def step_bar(what: str, total: int) -> Iterator[Callable[[int], None]]:
    """Show progress towards a number of steps.

    Args:
        what: One word for the work.
        total: Steps in all.

    Yields:
        A function to call with the steps done so far.
    """
    columns = (
        TextColumn(what),
        BarColumn(),
        TextColumn("{task.completed:,} of {task.total:,} steps"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=console, disable=not console.is_terminal, transient=True) as bar:
        task = bar.add_task(what, total=total)
        yield lambda steps: bar.update(task, completed=steps)
