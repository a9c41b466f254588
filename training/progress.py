"""What a person sees while a run learns: speed, success and time left."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Protocol

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn


class Watcher(Protocol):
    """Is told how a run goes on."""

    def begin(self) -> None:
        """The run begins."""

    def advance(self, share: float, elapsed_s: float, steps: int) -> None:
        """An update is done: share of the run that is over [-], its wall-clock [s], control steps so far."""

    def verdict(self, elapsed_s: float, success: float) -> None:
        """A check is done: wall-clock [s] and success rate [-]."""

    def end(self) -> None:
        """The run is over."""


class Speed:
    """Control steps per second, lately."""

    def __init__(self) -> None:
        """Begin without knowing."""
        self._last: tuple[float, int] | None = None
        self.rate = 0.0

    def update(self, elapsed_s: float, steps: int) -> float:
        """Steps per second, smoothed over about ten updates."""
        if self._last is not None and elapsed_s > self._last[0]:
            now = (steps - self._last[1]) / (elapsed_s - self._last[0])
            self.rate += (0.1 if self.rate else 1.0) * (now - self.rate)
        self._last = elapsed_s, steps
        return self.rate


class LearningBar:
    """A progress bar on standard error; plain lines where that is no terminal."""

    def __init__(self, run: Path | None = None) -> None:
        """Prepare, without drawing yet; with a run folder, say it first."""
        self._run = run
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
        self._speed = Speed()
        self._task = self._bar.add_task("learning", total=1.0, steps=0, rate=0.0, verdict="")

    def begin(self) -> None:
        """Start drawing."""
        if self._run is not None:
            self._console.print(f"run folder: {self._run}", markup=False, highlight=False, soft_wrap=True)
            self._run = None  # said once, also where a run has two parts
        self._bar.start()

    def advance(self, share: float, elapsed_s: float, steps: int) -> None:
        """Move the bar."""
        rate = self._speed.update(elapsed_s, steps)
        self._bar.update(self._task, completed=share, steps=steps, rate=rate)

    def verdict(self, elapsed_s: float, success: float) -> None:
        """Show the latest check; also as a line where there is no terminal."""
        self._bar.update(self._task, verdict=f"success {success:.3f}")
        if not self._console.is_terminal:
            rate = f"{self._speed.rate:,.0f} steps/s"
            self._console.print(
                f"learning {elapsed_s:5.0f} s  {rate}  success {success:.3f}", highlight=False
            )

    def end(self) -> None:
        """Stop drawing."""
        self._bar.stop()


class ProgressFile:
    """Writes how far a run is into its folder, now and then, for whoever waits for several runs."""

    EVERY_S = 0.5

    def __init__(self, path: Path) -> None:
        """Write to this file."""
        self._path, self._speed, self._next = path, Speed(), 0.0
        self._told: dict[str, float | int | None] = {"share": 0.0, "steps": 0, "rate": 0.0, "success": None}

    def begin(self) -> None:
        """Say that there is a run."""
        self._write()

    def advance(self, share: float, elapsed_s: float, steps: int) -> None:
        """Note how far it is."""
        rate = self._speed.update(elapsed_s, steps)
        self._told |= {"share": share, "elapsed_s": elapsed_s, "steps": steps, "rate": rate}
        if time.monotonic() >= self._next:
            self._write()

    def verdict(self, elapsed_s: float, success: float) -> None:
        """Note the latest check."""
        self._told["success"] = success
        self._write()

    def end(self) -> None:
        """Leave the last figures."""
        self._write()

    def _write(self) -> None:
        self._next = time.monotonic() + self.EVERY_S
        new = self._path.with_suffix(".new")
        new.write_text(json.dumps(self._told), encoding="utf-8")
        new.replace(self._path)
