"""A bar for each of several jobs, on standard error; a line for each end where that is no terminal."""

from __future__ import annotations

from collections.abc import Sequence
from types import TracebackType
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from training.jobs import Job


class JobBars:
    """Is a `Watch` while its context is open."""

    def __init__(self, jobs: Sequence[Job]) -> None:
        """Prepare a bar for each job."""
        self._console = Console(stderr=True, highlight=False)
        self._bars = Progress(
            TextColumn("{task.description}"),
            BarColumn(bar_width=24),
            TextColumn("{task.fields[text]}"),
            TimeRemainingColumn(elapsed_when_finished=True),
            console=self._console,
            disable=not self._console.is_terminal,
        )
        self._names = [job.name for job in jobs]
        self._tasks = [
            self._bars.add_task(name, total=1.0, text="waiting", start=False) for name in self._names
        ]

    def __enter__(self) -> JobBars:
        """Start drawing."""
        self._bars.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Stop drawing."""
        self._bars.stop()

    def __call__(self, number: int, state: str, progress: dict[str, Any]) -> None:
        """Show how far a job is."""
        task = self._tasks[number]
        success = progress.get("success")
        known = "" if success is None else f"  success {success:.3f}"
        share = progress.get("share", 0.0)
        running = "judging" if share >= 1.0 else f"{progress.get('rate', 0.0):,.0f} steps/s"
        text = (running if state == "running" else state) + known
        if state == "running":
            self._bars.start_task(task)
            self._bars.update(task, completed=share, text=text)
            return
        self._bars.update(task, completed=1.0, text=text)
        self._bars.stop_task(task)
        if not self._console.is_terminal:
            self._console.print(f"{self._names[number]}: {text}")
