"""Progress of training runs: bars in the terminal, a file, and curves on Weights & Biases."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Protocol

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from stable_baselines3.common.logger import KVWriter


class Watcher(Protocol):
    """Receives the progress of a run."""

    def begin(self) -> None:
        """The run begins."""

    def advance(self, share: float, elapsed_s: float, steps: int) -> None:
        """An update is done: share of the run that is over [-], its wall-clock [s], control steps so far."""

    def evaluated(self, elapsed_s: float, success: float) -> None:
        """A check is done: wall-clock [s] and success rate [-]."""

    def end(self) -> None:
        """The run is over."""


class Speed:
    """Control steps per second, lately."""

    def __init__(self) -> None:
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
                "{task.fields[steps]:,} steps  {task.fields[rate]:,.0f} steps/s  {task.fields[result]}"
            ),
            TimeRemainingColumn(),
            console=self._console,
            disable=not self._console.is_terminal,
        )
        self._speed = Speed()
        self._task = self._bar.add_task("learning", total=1.0, steps=0, rate=0.0, result="")

    def begin(self) -> None:
        """Start drawing."""
        if self._run is not None:
            self._console.print(f"run folder: {self._run}", markup=False, highlight=False, soft_wrap=True)
            self._run = None  # printed once, also where a run has two parts
        self._bar.start()

    def advance(self, share: float, elapsed_s: float, steps: int) -> None:
        """Move the bar."""
        rate = self._speed.update(elapsed_s, steps)
        self._bar.update(self._task, completed=share, steps=steps, rate=rate)

    def evaluated(self, elapsed_s: float, success: float) -> None:
        """Show the latest check; also as a line where there is no terminal."""
        self._bar.update(self._task, result=f"success {success:.3f}")
        if not self._console.is_terminal:
            rate = f"{self._speed.rate:,.0f} steps/s"
            line = f"learning {elapsed_s:5.0f} s  {rate}  success {success:.3f}"
            self._console.print(line, highlight=False, soft_wrap=True)

    def end(self) -> None:
        """Stop drawing."""
        self._bar.stop()


class DistillationBar:
    """A progress bar for distillations, one after another; nothing where there is no terminal."""

    def __init__(self) -> None:
        console = Console(stderr=True)
        self._bar = Progress(
            TextColumn("learning to keep all tasks"), BarColumn(), TimeRemainingColumn(),
            console=console, disable=not console.is_terminal,
        )  # fmt: skip
        self._task = self._bar.add_task("distillation", total=1.0)

    def __enter__(self) -> DistillationBar:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._bar.stop()

    def __call__(self, share: float) -> None:
        """Show the share that is done [-]."""
        if share < 1.0:
            self._bar.start()
        self._bar.update(self._task, completed=share)
        if share >= 1.0:
            self._bar.stop()


class ProgressNotes:
    """Hands the progress of a run on, now and then, to the process that runs several."""

    def __init__(self, write: Callable[[dict[str, float | int | None]], None], *, every_s: float) -> None:
        """Begin; `write` takes the figures at most every so many seconds while a run advances."""
        self._hand_on, self._every_s = write, every_s
        self._speed, self._next = Speed(), 0.0
        self._progress: dict[str, float | int | None] = {
            "share": 0.0,
            "steps": 0,
            "rate": 0.0,
            "success": None,
        }

    def begin(self) -> None:
        """Say that there is a run."""
        self._write()

    def advance(self, share: float, elapsed_s: float, steps: int) -> None:
        """Note how far it is."""
        rate = self._speed.update(elapsed_s, steps)
        self._progress |= {"share": share, "elapsed_s": elapsed_s, "steps": steps, "rate": rate}
        if time.monotonic() >= self._next:
            self._write()

    def evaluated(self, elapsed_s: float, success: float) -> None:
        """Note the latest check."""
        self._progress["success"] = success
        self._write()

    def end(self) -> None:
        """Leave the last figures."""
        self._write()

    def _write(self) -> None:
        self._next = time.monotonic() + self._every_s
        self._hand_on(self._progress)


def progress_file(path: Path) -> ProgressNotes:
    """Progress in a file of the run folder."""

    def write(progress: dict[str, float | int | None]) -> None:
        new = path.with_suffix(".new")
        new.write_text(json.dumps(progress), encoding="utf-8")
        new.replace(path)

    return ProgressNotes(write, every_s=0.5)


class JobBars:
    """A progress bar for each of several jobs, or a line at its end where there is no terminal: a `Watch`."""

    def __init__(self, names: Sequence[str]) -> None:
        self._console = Console(stderr=True, highlight=False)
        self._bars = Progress(
            TextColumn("{task.description}"),
            BarColumn(bar_width=24),
            TextColumn("{task.fields[text]}"),
            TimeRemainingColumn(elapsed_when_finished=True),
            console=self._console,
            disable=not self._console.is_terminal,
        )
        self._names = names
        self._tasks = [
            self._bars.add_task(name, total=1.0, text="waiting", start=False) for name in self._names
        ]

    def __enter__(self) -> JobBars:
        self._bars.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._bars.stop()

    def __call__(self, number: int, state: str, progress: dict[str, Any]) -> None:
        """Show the state of one job: its number, `running`, `done` or `failed`, and its newest figures."""
        task = self._tasks[number]
        success = progress.get("success")
        known = "" if success is None else f"  success {success:.3f}"
        share = progress.get("share", 0.0)
        running = "evaluating" if share >= 1.0 else f"{progress.get('rate', 0.0):,.0f} steps/s"
        text = (running if state == "running" else state) + known
        if state == "running":
            self._bars.start_task(task)
            self._bars.update(task, completed=share, text=text)
            return
        self._bars.update(task, completed=1.0, text=text)
        self._bars.stop_task(task)
        if not self._console.is_terminal:
            self._console.print(f"{self._names[number]}: {text}", markup=False, soft_wrap=True)


class WandbCurves(KVWriter):
    """Sends every number that is logged; WANDB_MODE=offline keeps them in the run folder."""

    def __init__(self, folder: Path, *, project: str, name: str, settings: dict[str, Any]) -> None:
        import wandb

        folder.mkdir(parents=True, exist_ok=True)
        self._run = wandb.init(project=project, name=name, dir=str(folder), config=settings)

    def write(
        self, key_values: dict[str, Any], key_excluded: dict[str, tuple[str, ...]], step: int = 0
    ) -> None:
        """Send what was logged since the last time."""
        numbers = {key: value for key, value in key_values.items() if isinstance(value, int | float)}
        self._run.log(numbers, step=step)

    def close(self) -> None:
        """Send the rest, and end the run there."""
        self._run.finish()
