"""The same jobs on the machines of a Ray cluster; each needs Fulmar installed with the extra `train`."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from fulmar_core.config.pool import Pool, report
from fulmar_core.config.process import environment
from fulmar_core.robots.calibration import VARIABLE, calibration_path
from training.executors import Executor, LocalExecutor, Watch
from training.jobs import Job, Outcome, run_job
from training.progress import ProgressNotes
from training.run_folder import CALIBRATION_FILE

Files = dict[str, bytes]  # content by path below a run folder
BUNDLE = "bundle"


class RayExecutor:
    """A core for each job; run folders go there and come back."""

    def __init__(self, address: str | None = None, pool: Pool | None = None) -> None:
        """Join a cluster, or begin one on this machine, as `RayPool` does; or use another pool."""
        if pool is None:
            from fulmar_core.config.ray_pool import RayPool  # Ray is an extra

            pool = RayPool(address)
        self._pool = pool

    def run(self, jobs: Sequence[Job], watch: Watch) -> list[Outcome]:
        """See `Executor.run`."""
        outcomes: dict[int, Outcome] = {}

        def on_done(number: int, result: Any) -> None:
            outcomes[number] = _outcome(jobs[number], result)
            watch(number, "failed" if outcomes[number].record is None else "done", {})

        def receive(reported: Mapping[int, dict[str, Any]]) -> None:
            for number, progress in reported.items():
                if number not in outcomes:
                    watch(number, "running", progress)

        given = calibration_path()
        more = {CALIBRATION_FILE: given.read_bytes()} if given else {}
        items = [(job, _files_of(job.out) | more) for job in jobs]
        self._pool.run(_work, items, on_done=on_done, watch=receive)
        return [outcomes[number] for number in range(len(jobs))]


def executor_at(ray: str | None, at_once: int | None = None) -> Executor:
    """A Ray cluster, by its address; without one so many processes of this machine, one for each core by default."""
    return LocalExecutor(at_once) if ray is None else RayExecutor(ray)


def _files_of(folder: Path) -> Files:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def _write(files: Files, folder: Path) -> None:
    for name, content in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)


def _outcome(job: Job, result: Any) -> Outcome:
    if isinstance(result, Exception):
        return Outcome(job, None, str(result))
    record, files, bundle = result
    _write(files, job.out)
    if job.bundle is not None:
        _write(bundle, job.bundle)
    return Outcome(job, record)


def _work(job: Job, files: Files) -> tuple[dict[str, Any], Files, Files]:
    """Do a job on whichever machine this is.

    Args:
        job: What to do; an interrupted run goes on.
        files: Of its run folder.

    Returns:
        Its record, and every file of its run folder and of its bundle.
    """
    with tempfile.TemporaryDirectory() as folder, tempfile.TemporaryDirectory() as bundles:
        here, bundle = Path(folder), Path(bundles) / BUNDLE
        _write(files, here)
        calibration = str(here / CALIBRATION_FILE) if CALIBRATION_FILE in files else ""
        moved = replace(job, out=here, bundle=bundle if job.bundle is not None else None)
        with environment({VARIABLE: calibration}):
            record = run_job(moved, ProgressNotes(report, every_s=1.0))
        return record, _files_of(here), _files_of(bundle)
