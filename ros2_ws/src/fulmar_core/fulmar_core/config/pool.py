"""Calls in several processes at once: those of this machine here, those of a Ray cluster in `ray_pool`."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from multiprocessing.process import BaseProcess
from typing import Any, Protocol

from fulmar_core.config.errors import RunFailed
from fulmar_core.config.process import end_with, environment

POLL_S = 0.2
# Sums of several threads depend on their number, and processes side by side have a core each.
ONE_THREAD = {f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "MKL")}

Item = tuple[Any, ...]
OnDone = Callable[
    [int, Any], None
]  # index of an item, and what its call returned, or the Exception it raised
Watch = Callable[[Mapping[int, Any]], None]  # what each call has reported so far, by index


class Pool(Protocol):
    """Processes that do calls."""

    def run(
        self, function: Callable[..., Any], items: Sequence[Item], *, on_done: OnDone, watch: Watch
    ) -> None:
        """Call a function with the arguments of each item, several at once, and return when all are done.

        Args:
            function: Of a module, so that other processes find it.
            items: Arguments of each call, the longest first.
            on_done: Called here for each item, in the order in which they end.
            watch: Called here now and then.

        Raises:
            RunFailed: A process was ended from outside.
        """


_receive: Callable[[Any], None] = lambda progress: None  # noqa: E731 - what processes of a pool replace


def report(progress: Any) -> None:
    """Report from inside a call how far it is; outside of a pool it goes nowhere.

    Args:
        progress: For processes of this machine a number.
    """
    _receive(progress)


def reporting_to(receive: Callable[[Any], None]) -> None:
    """Choose who receives what is reported in this process."""
    global _receive
    _receive = receive


class ProcessPool:
    """Processes of one thread each, on this machine; they end with us."""

    def __init__(self, at_once: int) -> None:
        """Keep how many there are, >= 1."""
        self._at_once = at_once

    def run(
        self, function: Callable[..., Any], items: Sequence[Item], *, on_done: OnDone, watch: Watch
    ) -> None:
        """See `Pool.run`."""
        if not items:
            return
        spawn = multiprocessing.get_context("spawn")
        reported = spawn.Array("d", len(items), lock=False)
        executor = ProcessPoolExecutor(
            min(self._at_once, len(items)), spawn, _begin_worker, (reported, os.getpid())
        )
        with environment(ONE_THREAD), ended_with_us(executor) as pool:
            futures = {pool.submit(_call, index, function, item): index for index, item in enumerate(items)}
            for future in as_they_end(futures, lambda: watch(dict(enumerate(reported)))):
                error = future.exception()
                if isinstance(error, BrokenProcessPool):
                    raise RunFailed("a worker process was ended from outside") from error
                on_done(futures[future], error or future.result())


def workers_of(pool: ProcessPoolExecutor) -> list[BaseProcess]:
    """The processes of a pool that run; children of this process that are not its own are left alone.

    `terminate_workers` of Python 3.14 reads the same attribute.
    """
    processes = pool._processes or {}
    return [process for process in list(processes.values()) if process.is_alive()]


@contextlib.contextmanager
def ended_with_us(pool: ProcessPoolExecutor) -> Iterator[ProcessPoolExecutor]:
    """Wait for the workers; after an error or Ctrl-C, end them."""
    try:
        yield pool
    except BaseException:
        for worker in workers_of(pool):
            worker.terminate()
        raise
    finally:
        pool.shutdown(cancel_futures=True)


def as_they_end(futures: Mapping[Future[Any], int], tick: Callable[[], None]) -> Iterator[Future[Any]]:
    """Give each future when it is done, and call `tick` before and in between."""
    pending = set(futures)
    while pending:
        done, pending = wait(pending, timeout=POLL_S, return_when=FIRST_COMPLETED)
        tick()
        yield from done


_counts: Any = None


def _begin_worker(counts: Any, parent: int) -> None:
    """Begin a process of a pool: without `parent` it ends, as its results would be lost."""
    global _counts
    _counts = counts
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the parent, which ends its children
    end_with(parent, signal.SIGTERM)


def _call(index: int, function: Callable[..., Any], item: Item) -> Any:
    def count(progress: float) -> None:
        _counts[index] = progress

    reporting_to(count)
    return function(*item)
