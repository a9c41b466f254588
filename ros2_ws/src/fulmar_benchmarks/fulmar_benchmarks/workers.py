"""Pool of worker processes: progress, failures per unit, an end with the parent."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from typing import TYPE_CHECKING, Any

from fulmar_benchmarks.results import PairResult
from fulmar_benchmarks.unit import Unit, done_already, run_unit
from fulmar_bringup.domains import environment
from fulmar_core.config.errors import RunFailed
from fulmar_core.config.process import end_with

if TYPE_CHECKING:
    from fulmar_evaluation.ros_evaluation import RosPool


_ONE_THREAD = {name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")}


def one_thread_each() -> contextlib.AbstractContextManager[None]:
    """Have the processes that are started meanwhile compute in one thread."""
    return environment(_ONE_THREAD)


@contextlib.contextmanager
def ended_with_us(pool: ProcessPoolExecutor) -> Iterator[ProcessPoolExecutor]:
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


def begin_worker(counts: Any, parent: int) -> None:
    """Begin a process of a pool.

    Args:
        counts: Shared numbers, one for each piece of work; see `counted`.
        parent: Process whose pool it is; without it we end, as nobody would take what we do.
    """
    global _counts
    _counts = counts
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the parent, which ends its children
    end_with(parent, signal.SIGTERM)


def counted(index: int) -> Callable[[int], None]:
    """A callback that reports progress to the parent, in a process that `begin_worker` began."""

    def progress(done: int) -> None:
        _counts[index] = done

    return progress


def mapped(
    function: Callable[..., Any],
    items: Sequence[tuple[Any, ...]],
    *,
    jobs: int,
    progress: Callable[[float, float], None],
) -> list[Any]:
    """Results of a function, called with the arguments of each item in a process of a pool, in their order.

    Args:
        function: Of a module, so that other processes find it.
        items: Arguments of each call.
        jobs: Processes at once.
        progress: Called with how many are done, and of how many.
    """
    spawn = multiprocessing.get_context("spawn")
    counts = spawn.Array("q", 1, lock=False)
    with (
        one_thread_each(),
        ended_with_us(ProcessPoolExecutor(jobs, spawn, begin_worker, (counts, os.getpid()))) as pool,
    ):
        futures = [pool.submit(function, *item) for item in items]
        pending = set(futures)
        while pending:
            _, pending = wait(pending, timeout=0.5, return_when=FIRST_COMPLETED)
            progress(float(len(futures) - len(pending)), float(len(futures)))
        try:
            return [future.result() for future in futures]
        except BrokenProcessPool as error:
            raise RunFailed("a process of the benchmark was ended from outside") from error


Outcome = PairResult | str  # a sentence where a unit failed
Done = Callable[[Unit, Outcome], None]


def evaluate_units(
    units: Sequence[Unit],
    *,
    jobs: int,
    fresh: bool,
    progress: Callable[[float, float], None],
    on_done: Callable[[Unit, Outcome, bool], None],
) -> dict[Unit, Outcome]:
    """Outcomes of units, from the files of an earlier run where these hold.

    Args:
        units: What to do.
        jobs: Processes at once.
        fresh: Whether to do again what was done before.
        progress: Called with how much is done, and of how much.
        on_done: Called with each unit, its outcome, and whether it was there before.
    """
    outcomes: dict[Unit, Outcome] = {**done_already(units, fresh=fresh)}
    for unit, before in outcomes.items():
        on_done(unit, before, True)
    left = [unit for unit in units if unit not in outcomes]
    total = sum(unit.cost for unit in left)
    return outcomes | do_all(
        left,
        jobs=jobs,
        progress=lambda done: progress(done, total),
        on_done=lambda unit, outcome: on_done(unit, outcome, False),
    )


def do_all(
    units: list[Unit], *, jobs: int, progress: Callable[[float], None], on_done: Done
) -> dict[Unit, Outcome]:
    """Do units, the costliest first; those through ros, which use all cores themselves, after the others.

    Raises:
        RunFailed: A process was ended from outside.
    """
    outcomes: dict[Unit, Outcome] = {}

    def note(unit: Unit, outcome: Outcome) -> None:
        outcomes[unit] = outcome
        on_done(unit, outcome)

    ordered = sorted(units, key=lambda unit: -unit.cost)
    ros = [unit for unit in ordered if unit.trial.through == "ros"]
    pooled = [unit for unit in ordered if unit not in ros]
    if pooled:
        _in_a_pool(pooled, min(jobs, len(pooled)), progress, note)
    if ros:
        _through_ros(ros, jobs, sum(unit.cost for unit in pooled), progress, note)
    return outcomes


def _beyond(done: float, progress: Callable[[float], None]) -> Callable[[float], None]:
    """Progress of one unit as that of all, of which some is done."""
    return lambda steps: progress(done + steps)


def _through_ros(
    units: list[Unit], jobs: int, done: float, progress: Callable[[float], None], note: Done
) -> None:
    """One after another, each on all workers: these are the deployed nodes, started once for all."""
    from fulmar_evaluation.ros_evaluation import ros_pool

    with ros_pool(jobs) as pool:
        for unit in units:
            note(unit, _outcome_of(unit, _beyond(done, progress), pool))
            done += unit.cost


def _in_a_pool(units: list[Unit], jobs: int, progress: Callable[[float], None], note: Done) -> None:
    spawn = multiprocessing.get_context("spawn")
    counts = spawn.Array("q", len(units), lock=False)
    with (
        one_thread_each(),
        ended_with_us(ProcessPoolExecutor(jobs, spawn, begin_worker, (counts, os.getpid()))) as pool,
    ):
        futures: dict[Future[Outcome], Unit] = {
            pool.submit(_work, unit, index): unit for index, unit in enumerate(units)
        }
        pending = set(futures)
        while pending:
            done, pending = wait(pending, timeout=0.2, return_when=FIRST_COMPLETED)
            progress(float(sum(counts)))
            for future in done:
                try:
                    note(futures[future], future.result())
                except BrokenProcessPool as error:
                    raise RunFailed("a process of the benchmark was ended from outside") from error


def _work(unit: Unit, index: int) -> Outcome:
    progress = counted(index)
    outcome = _outcome_of(unit, progress)
    progress(int(unit.cost))
    return outcome


def _outcome_of(unit: Unit, progress: Callable[[int], None], pool: RosPool | None = None) -> Outcome:
    try:
        return run_unit(unit, progress, pool=pool)
    except Exception as error:  # noqa: BLE001 - the fault of one pair must not cost the others their figures
        return f"{type(error).__name__}: {error}"
