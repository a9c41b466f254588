"""Pool of worker processes: progress, failures of single cells, an end with the parent."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from typing import Any

from fulmar_benchmarks.shape import POOL, ROS, Cell, Figures, Progress
from fulmar_bringup.domains import environment
from fulmar_core.config.errors import RunFailed
from fulmar_core.config.process import end_with

_ONE_THREAD = {name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")}
Note = Callable[[Cell, Figures | str], None]


def measure_all(cells: Sequence[Cell], *, jobs: int, progress: Progress, on_done: Note) -> None:
    """Measure cells, the costliest first; then one after another those that use all cores themselves.

    Args:
        cells: Which.
        jobs: Processes at once.
        progress: Called with how much of their cost is done.
        on_done: Called with each cell and its figures, or a sentence where it failed.

    Raises:
        RunFailed: A process was ended from outside.
    """
    ordered = sorted(cells, key=lambda cell: -cell.cost)
    pooled = [cell for cell in ordered if cell.where == POOL]
    if pooled:
        in_a_pool(pooled, min(jobs, len(pooled)), progress, on_done)
    done = sum(cell.cost for cell in pooled)
    with contextlib.ExitStack() as ending:
        pool = None
        for cell in (cell for cell in ordered if cell.where != POOL):
            if cell.where == ROS and pool is None:
                from fulmar_evaluation.ros_evaluation import ros_pool

                pool = ending.enter_context(ros_pool(jobs))  # the deployed nodes, started once for all
            on_done(cell, figures_of(cell, _beyond(done, progress), pool))
            done += cell.cost
            progress(done)


def figures_of(cell: Cell, progress: Progress, pool: Any = None) -> Figures | str:
    """Figures of a cell, or a sentence where it failed: its fault must not cost the others their figures."""
    try:
        return cell.measure(progress, pool)
    except Exception as error:  # noqa: BLE001 - whatever it is
        return f"{type(error).__name__}: {error}"


def _beyond(done: float, progress: Progress) -> Progress:
    """Progress of one cell as that of all, of which some is done."""
    return lambda more: progress(done + more)


@contextlib.contextmanager
def _ended_with_us(pool: ProcessPoolExecutor) -> Iterator[ProcessPoolExecutor]:
    """Wait for the workers; after an error or Ctrl-C, end them."""
    try:
        yield pool
    except BaseException:
        for worker in multiprocessing.active_children():
            worker.terminate()
        raise
    finally:
        pool.shutdown(cancel_futures=True)


_counts: Any = None


def _begin_worker(counts: Any, parent: int) -> None:
    """Begin a process of a pool; without its parent it ends, as nobody would take what it does."""
    global _counts
    _counts = counts
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the parent, which ends its children
    end_with(parent, signal.SIGTERM)


def in_a_pool(cells: Sequence[Cell], jobs: int, progress: Progress, on_done: Note) -> None:
    """Measure cells in so many processes of one thread each."""
    spawn = multiprocessing.get_context("spawn")
    counts = spawn.Array("d", len(cells), lock=False)
    with (
        environment(_ONE_THREAD),
        _ended_with_us(ProcessPoolExecutor(jobs, spawn, _begin_worker, (counts, os.getpid()))) as pool,
    ):
        futures: dict[Future[Figures | str], Cell] = {
            pool.submit(_work, cell, index): cell for index, cell in enumerate(cells)
        }
        pending = set(futures)
        while pending:
            done, pending = wait(pending, timeout=0.2, return_when=FIRST_COMPLETED)
            progress(float(sum(counts)))
            for future in done:
                try:
                    on_done(futures[future], future.result())
                except BrokenProcessPool as error:
                    raise RunFailed("a process of the benchmark was ended from outside") from error


def _work(cell: Cell, index: int) -> Figures | str:
    def progress(done: float) -> None:
        _counts[index] = done

    figures = figures_of(cell, progress)
    progress(cell.cost)
    return figures
