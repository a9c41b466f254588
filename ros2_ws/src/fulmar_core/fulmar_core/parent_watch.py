"""Processes that end with the one that started them."""

from __future__ import annotations

import ctypes
import os
import signal
import sys

_PR_SET_PDEATHSIG = 1  # prctl(2)


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
