"""A trial in parts, by several processes at once: for controllers that take seconds for an episode."""

from __future__ import annotations

import multiprocessing
import os
import zipfile
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import fields
from pathlib import Path

import numpy as np

from fulmar_bringup.evaluation import Progress, Trial, runs_of_part
from fulmar_bringup.pools import begin_worker, counted, ended_with_us, one_thread_each
from fulmar_core.controllers.controller import Controller
from fulmar_core.errors import RunFailed
from fulmar_core.metrics import Trajectories, join
from fulmar_core.whole_files import whole_file

_HEARD_S = 0.2  # between two looks at how far the processes are [s]


def runs_by_parts(
    trial: Trial, size: int, progress: Progress, keep: Path | None = None
) -> Iterator[Trajectories]:
    """Run the episodes of a trial; what happens does not depend on how many processes there are.

    Args:
        trial: What to run, in the batch or in MuJoCo, by `jobs` processes.
        size: Episodes of a part at most.
        progress: As in `runs_of`.
        keep: As in `runs_of`.

    Yields:
        What happened, part by part in their order.

    Raises:
        RunFailed: A process was ended from outside.
    """
    parts = [(first, min(size, trial.episodes - first)) for first in range(0, trial.episodes, size)]
    spawn = multiprocessing.get_context("spawn")
    counts = spawn.Array("q", len(parts), lock=False)
    jobs = min(trial.jobs, len(parts))
    with (
        one_thread_each(),
        ended_with_us(ProcessPoolExecutor(jobs, spawn, begin_worker, (counts, os.getpid()))) as pool,
    ):
        futures = [pool.submit(_run, trial, *part, number, keep) for number, part in enumerate(parts)]
        for future in futures:
            while not wait((future,), timeout=_HEARD_S).done:
                progress(sum(counts))
            try:
                yield future.result()
            except BrokenProcessPool as error:
                raise RunFailed("a process of the evaluation was ended from outside") from error
        progress(sum(counts))


_made: dict[Trial, Controller] = {}  # of this process; loading takes a second


def _run(trial: Trial, first: int, episodes: int, number: int, keep: Path | None) -> Trajectories:
    path = keep / f"{first}_{episodes}.npz" if keep else None
    run = _kept(path) if path else None
    if run is None:
        if trial not in _made:
            _made[trial] = trial.controller()
        run = join(list(runs_of_part(trial, _made[trial], first, episodes, counted(number))))
        if path:
            path.parent.mkdir(parents=True, exist_ok=True)
            with whole_file(path) as file:
                np.savez(file, **{each.name: getattr(run, each.name) for each in fields(run)})
    counted(number)(run.x.size)
    return run


def _kept(path: Path) -> Trajectories | None:
    """A part that was done before; None where there is none, or not all of it."""
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = {each.name: file[each.name] for each in fields(Trajectories)}
            return Trajectories(**{name: each if each.ndim else each.item() for name, each in arrays.items()})
    except (OSError, ValueError, KeyError, zipfile.BadZipFile):
        return None
