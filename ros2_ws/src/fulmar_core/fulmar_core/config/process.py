"""Process settings: thread priority, ending with the parent process, and temporary environment variables."""

from __future__ import annotations

import contextlib
import ctypes
import os
import signal
import sys
from collections.abc import Iterator, Mapping

# Above every ordinary thread. The plant before the controller: threads of one priority do not interrupt each
# other, and a controller that spins for ever must not keep the watchdog from closing the valves.
CONTROL_PRIORITY, PLANT_PRIORITY = 10, 20
RT_LIMIT = 98  # priority that a user is allowed; 99 is left to the kernel


def take_priority(priority: int) -> bool:
    """Put the calling thread before every ordinary one (SCHED_FIFO, 1 to 99), where this process may.

    Returns:
        Whether it could; without the right to it the thread keeps its place and is late when others are busy.
    """
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    except (PermissionError, AttributeError):
        return False
    return True


def take_priority_with_helpers(priority: int) -> None:
    """The same for every other thread of this process that has none yet, but for the main one.

    Messages pass through threads of the middleware. One of them that waits for the processor holds up, with the locks
    that it holds, also who stands before every ordinary thread. The main thread only starts and ends a node.
    """
    try:
        threads = [int(name) for name in os.listdir("/proc/self/task")]
    except OSError:
        return
    for thread in threads:
        with contextlib.suppress(OSError, AttributeError):  # it may have ended, or we may not
            if thread != os.getpid() and os.sched_getscheduler(thread) == os.SCHED_OTHER:
                os.sched_setscheduler(thread, os.SCHED_FIFO, os.sched_param(priority))


def give_up_priority() -> None:
    """Make the calling thread an ordinary one: a thread begins with the priority of whoever started it."""
    with contextlib.suppress(OSError, AttributeError):
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))


LAUNCHER_PID = (
    "FULMAR_PARENT_PID"  # environment variable: id of the process that started a node and watches it
)
_STOPPED = ("T", "t")  # states of a process in proc(5): by a signal, or by a debugger
_PR_SET_PDEATHSIG = 1  # prctl(2)


def is_stopped(process: int) -> bool:
    """Whether a process, by its id, was stopped in its tracks, as by SIGSTOP; Linux alone says so."""
    try:
        with open(f"/proc/{process}/stat", encoding="ascii", errors="replace") as file:
            after_name = file.read().rpartition(")")[2]
    except OSError:
        return False
    return after_name.split()[:1] in ([state] for state in _STOPPED)


def end_with(parent: int, ending: signal.Signals) -> None:
    """Ask the kernel for a signal when the process that started us dies; Linux alone does so, others go on.

    Args:
        parent: Its id. Where that is no longer our parent, it is dead already, and the signal comes at once.
        ending: The signal.
    """
    if not sys.platform.startswith("linux"):
        return
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, int(ending))
    if os.getppid() != parent:
        os.kill(os.getpid(), ending)


@contextlib.contextmanager
def environment(values: Mapping[str, str]) -> Iterator[None]:
    """Set variables of this process and the children that it starts, until the context ends."""
    before = {name: os.environ.get(name) for name in values}
    os.environ.update(values)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
