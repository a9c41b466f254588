"""What a person sees while a run learns: a bar with speed, success and time left."""

from __future__ import annotations

from types import TracebackType

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn


class LearningBar:
    """A progress bar on standard error; plain lines where that is no terminal."""

    def __init__(self, time_limit_s: float) -> None:
        """Show progress towards a wall-clock limit [s]."""
        self._console = Console(stderr=True)
        self._bar = Progress(
            TextColumn("learning"),
            BarColumn(),
            TextColumn(
                "{task.fields[steps]:,} steps  {task.fields[rate]:,.0f} steps/s  {task.fields[verdict]}"
            ),
            TimeRemainingColumn(),
            console=self._console,
            disable=not self._console.is_terminal,
        )
        self._task = self._bar.add_task("learning", total=time_limit_s, steps=0, rate=0.0, verdict="")

    def __enter__(self) -> LearningBar:
        """Start drawing."""
        self._bar.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Stop drawing."""
        self._bar.stop()

    def advance(self, elapsed_s: float, steps: int) -> None:
        """Move the bar to a wall-clock time."""
        self._bar.update(self._task, completed=elapsed_s, steps=steps, rate=steps / max(elapsed_s, 1e-9))

    def verdict(self, elapsed_s: float, text: str) -> None:
        """Show the latest check; also as a line where there is no terminal."""
        self._bar.update(self._task, verdict=text)
        if not self._console.is_terminal:
            self._console.print(f"learning {elapsed_s:5.0f} s  {text}")
