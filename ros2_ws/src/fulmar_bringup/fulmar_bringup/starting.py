"""Processes that get ready: who waits for them learns when one has ended, or when it takes too long."""

from __future__ import annotations

import time
from collections.abc import Callable

from fulmar_bringup.processes import ProcessGroup
from fulmar_bringup.supervisor import START_TIMEOUT_S, Report, Supervisor
from fulmar_core.errors import RunFailed

CONTROLLER_AND_RECORDER = 2  # who has to know the goal before anything moves


def raise_if_ended(group: ProcessGroup) -> None:
    """Give up where a process has ended.

    Raises:
        RunFailed: With its name, how it ended and, where it gave up by itself, its last words.
    """
    end = group.ended()
    if end is not None:
        words = group.last_words(end.name, ended=True) if (end.returncode or 0) > 0 else ""
        raise RunFailed(f"{end.text} before the run was over" + (f": {words}" if words else ""))


def while_starting(group: ProcessGroup, overseer: Supervisor) -> Callable[[], None]:
    """What to call while nodes get ready, from now on; it raises `RunFailed` where waiting has no sense any more."""
    began_s = time.monotonic()

    def alive() -> None:
        raise_if_ended(group)
        if time.monotonic() - began_s > START_TIMEOUT_S:
            plant, controller = _said(overseer.plant), _said(overseer.controller)
            raise RunFailed(
                f"the nodes did not get ready within {START_TIMEOUT_S:g} s (the plant said: {plant}; "
                f"the controller said: {controller}). "
                "Is another system running in this ROS domain? Try `fulmar doctor`."
            )

    return alive


def _said(report: Report) -> str:
    """What a node said last, and when: one that is heard no more is another fault than one that has nothing new."""
    if not report.heard:
        return "nothing"
    refused = report.values.get("goal_refused")
    more = f" (it refused the goal: {refused})" if refused else ""
    return f"{report.message or report.level}{more}, {time.monotonic() - report.heard:.1f} s ago"
