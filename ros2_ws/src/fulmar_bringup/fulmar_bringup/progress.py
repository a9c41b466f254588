"""Bars for long work, on standard error, only on a terminal."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator

from rich.progress import (
    BarColumn,
    Progress,
    ProgressColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from fulmar_bringup.console import console


def step_bar(what: str, total: int) -> contextlib.AbstractContextManager[Callable[[float], None]]:
    """Progress of some work of `total` control steps: a context whose function receives the steps done so far."""
    return _bar(what, total, TextColumn("{task.completed:,} of {task.total:,} steps"), TimeRemainingColumn())


@contextlib.contextmanager
def live_line() -> Iterator[Callable[[float, float | None, str], None]]:
    """One line about a system without planned end; the function receives time [s], distance from goal [m], mode."""
    with Progress(TextColumn("{task.description}"), console=console, disable=not console.is_terminal) as bar:
        task = bar.add_task("starting", total=None)
        yield lambda time_s, distance_m, mode: bar.update(
            task, description=f"{time_s:8.1f} s  {state_words(distance_m, mode)}"
        )


def state_words(distance_m: float | None, mode: str) -> str:
    """Distance from the goal [m], if there is one, and the mode of a system."""
    return f"{mode}, {distance_m:.2f} m from the goal" if distance_m is not None else mode


@contextlib.contextmanager
def time_bar(what: str, total_s: float) -> Iterator[Callable[..., None]]:
    """Progress through `total_s` of simulated time [s]; the function receives the time passed [s] and a few words."""
    columns = (
        TextColumn(what),
        BarColumn(),
        TextColumn("{task.completed:5.1f} of {task.total:.0f} s simulated"),
        TimeElapsedColumn(),
        TextColumn("{task.description}"),
    )
    with Progress(*columns, console=console, disable=not console.is_terminal, transient=True) as bar:
        task = bar.add_task("", total=total_s)
        yield lambda done_s, words="": bar.update(task, completed=done_s, description=words)


@contextlib.contextmanager
def work_bar(what: str) -> Iterator[Callable[[float, float], None]]:
    """Progress of work of several kinds; the function receives how much is done so far, and of how much."""
    columns = (TextColumn(what), BarColumn(), TextColumn("{task.percentage:3.0f} %"), TimeRemainingColumn())
    with Progress(*columns, console=console, disable=not console.is_terminal, transient=True) as bar:
        task = bar.add_task(what, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=max(total, 1e-9))


@contextlib.contextmanager
def _bar(what: str, total: float, *more: ProgressColumn) -> Iterator[Callable[[float], None]]:
    columns = (TextColumn(what), BarColumn(), *more)
    with Progress(*columns, console=console, disable=not console.is_terminal, transient=True) as bar:
        task = bar.add_task(what, total=total)
        yield lambda done: bar.update(task, completed=done)
