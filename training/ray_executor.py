"""The same jobs on the machines of a Ray cluster; each needs Fulmar installed with the extra `train`."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import ray

from fulmar_core.config.errors import FulmarError
from training.executors import Watch
from training.jobs import Job, Outcome, run_job
from training.progress import ProgressNotes

POLL_S = 0.5


class RayExecutor:
    """A task of one core for each job; run folders come back to this machine."""

    def __init__(self, address: str | None = None) -> None:
        """Join a cluster, or begin one on this machine.

        Args:
            address: Of the cluster, as `ray.init` takes it; RAY_ADDRESS or a new local one by default.
        """
        if not ray.is_initialized():
            ray.init(address=address, log_to_driver=False, logging_level="ERROR")

    def run(self, jobs: Sequence[Job], watch: Watch) -> list[Outcome]:
        """See `Executor.run`."""
        board = _Board.remote()
        tasks = {_work.remote(number, job, board): number for number, job in enumerate(jobs)}
        outcomes: dict[int, Outcome] = {}
        try:
            while tasks:
                done, _ = ray.wait(list(tasks), timeout=POLL_S)
                for number, progress in ray.get(board.read.remote()).items():
                    if number not in outcomes:
                        watch(number, "running", progress)
                for task in done:
                    number = tasks.pop(task)
                    outcomes[number] = _outcome(jobs[number], task)
                    watch(number, "failed" if outcomes[number].record is None else "done", {})
        finally:
            for task in tasks:  # after an interrupt
                ray.cancel(task)
        return [outcomes[number] for number in range(len(jobs))]


def _outcome(job: Job, task: Any) -> Outcome:
    try:
        record, files = ray.get(task)
    except ray.exceptions.RayError as error:
        reason = getattr(error, "cause", None) or error
        return Outcome(job, None, str(reason).strip().splitlines()[-1])
    for name, content in files.items():
        path = job.out / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
    return Outcome(job, record)


@ray.remote(num_cpus=0)
class _Board:
    """Progress of the jobs on all machines."""

    def __init__(self) -> None:
        self._progress: dict[int, dict[str, Any]] = {}

    def write(self, number: int, progress: dict[str, Any]) -> None:
        self._progress[number] = progress

    def read(self) -> dict[int, dict[str, Any]]:
        return self._progress


@ray.remote(max_retries=0)
def _work(number: int, job: Job, board: Any) -> tuple[dict[str, Any], dict[str, bytes]]:
    """Do a job on whichever machine this is; returns its record and every file of its folder."""
    with tempfile.TemporaryDirectory() as folder:
        here = Path(folder)
        bundle = here / "bundle" if job.bundle is not None else None
        notes = ProgressNotes(lambda progress: board.write.remote(number, progress), every_s=1.0)
        try:
            record = run_job(replace(job, out=here, bundle=bundle), notes)
        except FulmarError as error:
            raise RuntimeError(str(error)) from None
        files = {str(path.relative_to(here)): path.read_bytes() for path in here.rglob("*") if path.is_file()}
    return record, files
