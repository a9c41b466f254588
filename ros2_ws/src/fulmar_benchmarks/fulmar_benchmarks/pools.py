"""What pools of processes have in common: one thread each, progress that is told, and an end with ours."""

from __future__ import annotations

import contextlib
import multiprocessing
import signal
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from typing import Any

from fulmar_bringup.domains import environment
from fulmar_core.process import end_with

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
    """What tells the parent how much of a piece of work is done, in a process that `begin_worker` began."""

    def progress(done: int) -> None:
        _counts[index] = done

    return progress
