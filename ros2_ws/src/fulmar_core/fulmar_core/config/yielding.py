"""Gives way while a process starts beside a robot that moves, and takes its place once it has started.

Linux shares the processor among sessions where `sched_autogroup_enabled` is 1, and a launcher gives each node a session
of its own: the nice value of a thread then counts inside its session alone, that of the session counts among all. Where
it is 0, the nice value of the thread counts. Anybody may lower both, and raise the session's again, but not the
thread's, sched(7): so what takes long runs in a thread of its own, which ends.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

BEHIND = 10  # nice value of what gives way to everything that controls
AUTOGROUP = "/proc/self/autogroup"  # nice value of our session
_AGAIN_S, _TRIES = 0.05, 20  # the kernel takes a value every 0.1 s from ordinary users

_Result = TypeVar("_Result")
_gave_way: list[int] = []  # the session whose nice value we lowered


def in_yielding_thread(work: Callable[[], _Result]) -> _Result:
    """Do something in a thread that gives way to everything that controls; returns or raises what it does."""
    with ThreadPoolExecutor(1, initializer=_yield_thread) as pool:
        return pool.submit(work).result()


def yield_session() -> bool:
    """Let our session give way, until `take_place`.

    Returns:
        Whether it does: not where others share it, and not without autogroups.
    """
    if os.getsid(0) != os.getpid() or not _set_session(BEHIND):
        return False
    _gave_way.append(os.getpid())
    return True


def take_place() -> None:
    """Let our session count as any other again, where `yield_session` has lowered it."""
    if os.getpid() in _gave_way:
        _gave_way.clear()
        _set_session(0)


def _yield_thread() -> None:
    if sys.platform.startswith("linux"):  # elsewhere that would be the whole process
        os.nice(BEHIND)


def _set_session(nice: int) -> bool:
    for _ in range(_TRIES):
        try:
            with open(AUTOGROUP, "w", encoding="ascii") as file:
                file.write(str(nice))
            return True
        except BlockingIOError:
            time.sleep(_AGAIN_S)
        except OSError:
            return False
    return False
