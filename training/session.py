"""A training run between two updates: checks on held-out episodes, checkpoints, annealing, and its end."""

from __future__ import annotations

import math
import signal
import threading
import time
import types
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from stable_baselines3.common.callbacks import BaseCallback

from training.checkpoint import save_checkpoint
from training.deploy import deployed_network
from training.evaluator import Check, Evaluator
from training.fallback_policy import FallbackPolicy
from training.learners import KlAdaptiveRate
from training.network import DeployedNetwork
from training.progress import Watcher
from training.settings import TrainingSettings
from training.vec_env import BatchVecEnv


@dataclass(frozen=True)
class Limits:
    """Limits of a run; the first one reached ends it."""

    time_s: float | None = None  # wall-clock [s]
    updates: int | None = None

    def progress(self, elapsed_s: float, updates: int) -> float:
        """Share of the run that is over [-]."""
        shares = [0.0]
        if self.time_s is not None:
            shares.append(elapsed_s / self.time_s)
        if self.updates is not None:
            shares.append(updates / self.updates)
        return min(1.0, max(shares))


@dataclass
class RunHistory:
    """History of a run, also across an interruption."""

    elapsed_s: float = 0.0  # wall-clock that earlier parts took [s]
    cpu_s: float = 0.0  # processor time of the same, of all threads [s]
    updates: int = 0
    checks: list[Check] = field(default_factory=list)
    best: tuple[Check, DeployedNetwork] | None = None


class RunIsOver(Exception):  # noqa: N818 - it is the planned end, not an error
    """Ends learning between two updates."""


class Session(BaseCallback):
    """Callback that checks, saves, anneals and ends a run between two updates."""

    def __init__(
        self,
        history: RunHistory,
        *,
        evaluator: Evaluator,
        settings: TrainingSettings,
        limits: Limits,
        worlds: BatchVecEnv,
        command_scale: np.ndarray,
        fallback: FallbackPolicy | None,
        watcher: Watcher,
        checkpoint: Path,
        asked_to_stop: Callable[[], bool],
    ) -> None:
        """Begin, or go on.

        Args:
            history: The run so far.
            evaluator: Evaluates a network on held-out episodes.
            settings: Of the run.
            limits: Of the run.
            worlds: That it learns in.
            command_scale: Full command of each actuator, in its own unit.
            fallback: Policy that takes over when the robot is uncontrollable.
            watcher: Receives the progress.
            checkpoint: File to resume from later.
            asked_to_stop: Whether the user asked for the end.
        """
        super().__init__()
        self.history, self._evaluator, self._settings, self._limits = history, evaluator, settings, limits
        self._worlds, self._command_scale, self._watcher = worlds, command_scale, watcher
        self._fallback = fallback
        self._checkpoint, self._asked_to_stop = checkpoint, asked_to_stop
        self._before_s, self._cpu_before_s = history.elapsed_s, history.cpu_s
        self._began, self._cpu_began = time.monotonic(), time.process_time()
        # A share of the run, not a time: which network is best must not depend on the speed of the machine.
        self._check_every = settings.evaluate_every_s / (limits.time_s or settings.time_limit_s)
        self._plan_check(limits.progress(history.elapsed_s, history.updates))
        self._next_checkpoint = self.elapsed_s + settings.checkpoint_every_s
        self._first = True  # no update is done before the first rollout
        self._speeds: list[float] = []  # of each update [steps/s]
        self._since = (time.monotonic(), 0)

    @property
    def elapsed_s(self) -> float:
        """Wall-clock of learning, over all parts of the run [s]."""
        return self._before_s + time.monotonic() - self._began

    def _take_time(self) -> None:
        self.history.elapsed_s = self.elapsed_s
        self.history.cpu_s = self._cpu_before_s + time.process_time() - self._cpu_began

    @property
    def steps_per_s(self) -> float:
        """Median speed of learning, checks and checkpoints apart [control steps/s]."""
        return float(np.median(self._speeds)) if self._speeds else 0.0

    @property
    def _steps(self) -> int:
        """Control steps of all worlds so far."""
        return self.num_timesteps * self._worlds.hold

    def _on_training_start(self) -> None:
        self._watcher.begin()

    def _on_training_end(self) -> None:
        self._watcher.end()

    def _on_step(self) -> bool:
        return True

    def _on_rollout_start(self) -> None:
        if not self._first:
            began, steps = self._since
            self._speeds.append((self._steps - steps) / (time.monotonic() - began))
        self._between_updates()
        self._since = time.monotonic(), self._steps

    def _between_updates(self) -> None:
        history = self.history
        history.updates += not self._first
        self._first = False
        self._take_time()
        progress = self._limits.progress(history.elapsed_s, history.updates)
        self._watcher.advance(progress, history.elapsed_s, self._steps)
        if self._settings.annealing:
            self._worlds.set_effort(self._settings.effort(progress))
            self.model.ent_coef = self._settings.entropy(progress)  # type: ignore[attr-defined]
            rate = self.model.learning_rate
            assert isinstance(rate, KlAdaptiveRate)
            rate.target = self._settings.target_kl(progress)
        over, stopped = progress >= 1.0, self._asked_to_stop()
        due = over or progress >= self._next_check
        if due:
            self._check()
            self._plan_check(
                self._limits.progress(self.elapsed_s, history.updates)
            )  # a check takes time itself
            over = over or self._learned()
        if over or stopped or self.elapsed_s >= self._next_checkpoint:
            self.save()
            self._next_checkpoint = self.elapsed_s + self._settings.checkpoint_every_s
        if stopped and not due:
            self._check()  # after the checkpoint: a resumed run must be as if it had not been interrupted
        if over or stopped:
            raise RunIsOver

    def _plan_check(self, progress: float) -> None:
        """The next check comes at the next whole multiple of its share of the run, also after a resume."""
        self._next_check = (math.floor(progress / self._check_every + 1e-9) + 1) * self._check_every

    def _check(self) -> None:
        history = self.history
        normaliser = self.model.get_vec_normalize_env()
        assert normaliser is not None
        network = deployed_network(self.model, normaliser, self._command_scale, self._fallback)
        success, score = self._evaluator(network)
        check = Check(history.elapsed_s, self._steps, success, score)
        # A refined run is meant to end otherwise than it was in between, so its last network is the one to keep.
        if history.best is None or score > history.best[0].score or self._settings.annealing:
            history.best = check, network  # at once: an interrupt may come anywhere
        history.checks.append(check)
        self._watcher.evaluated(history.elapsed_s, success)
        self.logger.record("held_out/success_rate", success)
        self.logger.record("held_out/score", score)

    def _learned(self) -> bool:
        """Whether the last checks all reached the success rate."""
        enough = self._settings.stop_at_success
        return enough is not None and enough.reached([check.success_rate for check in self.history.checks])

    def save(self) -> None:
        """Write a checkpoint."""
        self._take_time()
        more: dict[str, Any] = {"history": self.history}
        save_checkpoint(self._checkpoint, self.model, more)


@contextmanager
def polite_interrupt() -> Iterator[threading.Event]:
    """Turn the first Ctrl-C into a request to stop; the second one interrupts at once."""
    asked = threading.Event()
    if threading.current_thread() is not threading.main_thread():
        yield asked
        return

    def ask(number: int, frame: types.FrameType | None) -> None:
        if asked.is_set():
            raise KeyboardInterrupt
        asked.set()

    before = signal.signal(signal.SIGINT, ask)
    try:
        yield asked
    finally:
        signal.signal(signal.SIGINT, before)
