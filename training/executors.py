"""Runs jobs in processes of this machine, several at once."""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Protocol

from fulmar_core.config.errors import ConfigError, FulmarError
from training.jobs import Job, Outcome, read_progress, run_job
from training.run_folder import read_run_record

LOG_FILE = "log.txt"  # output of a job, in its run folder
POLL_S = 0.2

# Receives each job's number, state (waiting, running, done, failed) and progress, now and then.
Watch = Callable[[int, str, dict[str, Any]], None]


class Executor(Protocol):
    """Runs jobs, and returns their outcomes."""

    def run(self, jobs: Sequence[Job], watch: Watch) -> list[Outcome]:
        """Run jobs to their end; a failed one does not stop the others."""


class LocalExecutor:
    """A process of one thread for each job, as many at once as there are cores."""

    def __init__(self, at_once: int | None = None) -> None:
        """Run this many jobs at once; one for each core by default."""
        self._at_once = at_once or len(os.sched_getaffinity(0))

    def run(self, jobs: Sequence[Job], watch: Watch) -> list[Outcome]:
        """See `Executor.run`; Ctrl-C lets every process finish its run folder."""
        outcomes: dict[int, Outcome] = {}
        running: dict[int, subprocess.Popen[bytes]] = {}
        waiting = list(range(len(jobs)))
        try:
            while waiting or running:
                while waiting and len(running) < self._at_once:
                    number = waiting.pop(0)
                    running[number] = _start(jobs[number])
                time.sleep(POLL_S)
                self._collect(jobs, running, outcomes, watch)
        except KeyboardInterrupt:
            for process in running.values():
                assert process.stdin is not None
                process.stdin.close()
            for process in running.values():
                process.wait()
            raise
        return [outcomes[number] for number in range(len(jobs))]

    @staticmethod
    def _collect(
        jobs: Sequence[Job],
        running: dict[int, subprocess.Popen[bytes]],
        outcomes: dict[int, Outcome],
        watch: Watch,
    ) -> None:
        for number, process in list(running.items()):
            code = process.poll()
            if code is None:
                watch(number, "running", read_progress(jobs[number]))
                continue
            del running[number]
            outcomes[number] = _outcome(jobs[number], code)
            state = "failed" if outcomes[number].record is None else "done"
            watch(number, state, read_progress(jobs[number]))


def _start(job: Job) -> subprocess.Popen[bytes]:
    job.out.mkdir(parents=True, exist_ok=True)
    limits = {f"{library}_NUM_THREADS": "1" for library in ("OMP", "MKL", "OPENBLAS")}
    with (job.out / LOG_FILE).open("ab") as log:
        process = subprocess.Popen(
            [sys.executable, "-c", "from training.executors import work; raise SystemExit(work())"],
            stdin=subprocess.PIPE,
            stdout=log,
            stderr=log,
            env=os.environ | limits,
            start_new_session=True,  # we pass on a Ctrl-C of the terminal, once
        )
    assert process.stdin is not None
    pickle.dump(job, process.stdin)
    process.stdin.flush()
    return process


def _outcome(job: Job, code: int) -> Outcome:
    if code == 0:
        try:
            return Outcome(job, read_run_record(job.out))
        except ConfigError as error:
            return Outcome(job, None, str(error))
    return Outcome(job, None, _last_words(job.out / LOG_FILE) or f"ended with code {code}")


def _last_words(log: Path) -> str:
    lines = log.read_text(encoding="utf-8", errors="replace").splitlines()
    return next((line.strip() for line in reversed(lines) if line.strip()), "")


def work() -> int:
    """Main function of a job's process; returns 0, else the last line of standard error has the reason."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    source = sys.stdin.buffer
    job = pickle.load(source)  # from our own parent, over a pipe
    threading.Thread(target=_follow, args=(source.fileno(),), daemon=True).start()
    try:
        run_job(job)
    except FulmarError as error:
        print(error, file=sys.stderr)  # noqa: T201 - it is all that the parent reads
        return 2
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)  # noqa: T201
        return 130
    return 0


def _follow(pipe: int) -> None:
    """Interrupt this process once the parent closes the pipe, or dies."""
    while os.read(pipe, 1):
        pass
    os.kill(os.getpid(), signal.SIGINT)
