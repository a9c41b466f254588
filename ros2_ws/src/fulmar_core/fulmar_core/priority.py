"""Priority of the threads that a robot waits for."""

from __future__ import annotations

import os

# Above every ordinary thread. The plant before the controller: threads of one priority do not interrupt each
# other, and a controller that spins for ever must not keep the watchdog from closing the valves.
CONTROL_PRIORITY, PLANT_PRIORITY = 10, 20


def take_priority(priority: int) -> bool:
    """Put the calling thread before every ordinary one (SCHED_FIFO), where this process may.

    Args:
        priority: Among such threads, 1 to 99; the higher interrupts the lower.

    Returns:
        Whether it could; without the right to it the thread keeps its place and is late when others are busy.
    """
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    except (PermissionError, AttributeError):
        return False
    return True
