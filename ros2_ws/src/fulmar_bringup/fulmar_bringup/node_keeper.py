"""Watches the processes of a system that runs: starts helpers again, and says when the robot must end."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from fulmar_bringup.console import log_line
from fulmar_bringup.node_spec import ENDS, NodeSpec
from fulmar_bringup.node_table import row_of
from fulmar_bringup.processes import Ended, ProcessGroup
from fulmar_bringup.supervisor import Supervisor
from fulmar_core.config.errors import RunFailed

LOOK_S = 0.25  # between two looks at the states of processes
STOPPED_S = 3.0  # in its tracks, as by SIGSTOP, before a process counts as lost
HANGS_S = 10.0  # without a status, before the process of a helper does; each reports once a second
WAITS_S = (0.0, 1.0, 2.0, 4.0, 8.0)  # before a node is started again for the first time, the second time, ...
WITHIN_S = 120.0  # starts that are older no longer count

OnRestart = Callable[[str, str], None]  # name of the node, and why


@dataclass(frozen=True)
class Restart:
    """A node that was started again, or left out."""

    node: str
    reason: str
    left_out: bool = False

    @property
    def warning(self) -> str:
        """For the result of a run."""
        if self.left_out:
            return f"{self.reason}; it did not last, and the robot goes on without it"
        return f"{self.reason}; it was started again, and the robot went on"


class RestartTimes:
    """When a node may be started again: later after each start, and not after too many in a time."""

    def __init__(self, waits_s: Sequence[float] = WAITS_S, within_s: float = WITHIN_S) -> None:
        """Begin without a start."""
        self._waits_s, self._within_s = tuple(waits_s), within_s
        self._starts: deque[float] = deque()

    def due(self, lost_s: float) -> float | None:
        """When a node that was lost at a time is due; None: no more. Both by a steady clock [s]."""
        while self._starts and lost_s - self._starts[0] > self._within_s:
            self._starts.popleft()
        if len(self._starts) == len(self._waits_s):
            return None
        return lost_s + self._waits_s[len(self._starts)]

    def note(self, now_s: float) -> None:
        """It was started."""
        self._starts.append(now_s)


class NodeKeeper:
    """Looks after the children of one launcher once they all run.

    Attributes:
        restarts: What was started again, or left out, in order.
    """

    def __init__(
        self, group: ProcessGroup, overseer: Supervisor, on_restart: OnRestart = lambda *_: None
    ) -> None:
        """Begin to watch.

        Args:
            group: The children.
            overseer: Receives what they report.
            on_restart: Called after each start.
        """
        self._group, self._overseer, self._on_restart = group, overseer, on_restart
        self.restarts: list[Restart] = []
        self._times: dict[str, RestartTimes] = {}
        self._due: dict[str, tuple[float, str]] = {}  # when a lost node is started again, and why it was lost
        self._left_out: set[str] = set()
        self._stopped_since: dict[str, float] = {}
        self._began: dict[str, float] = {}  # when a node was started again
        self._looks_s = 0.0

    def look(self) -> None:
        """Start lost helpers again where they are due.

        Raises:
            RunFailed: A node is lost without which the robot must end.
        """
        now_s = time.monotonic()
        for name, (due_s, reason) in list(self._due.items()):
            if now_s >= due_s:
                self._start_again(name, reason, now_s)
        stopped = now_s - self._looks_s >= LOOK_S
        self._looks_s = now_s if stopped else self._looks_s
        for name, spec in self._group.specs.items():
            if name in self._due or name in self._left_out:
                continue
            problem = self._end_of(name) or (self._hang_of(spec, now_s) if stopped else "")
            if problem and spec.loss == ENDS:
                raise RunFailed(f"{problem} before the run was over")
            if problem:
                self._lose(name, problem, now_s)

    def _end_of(self, name: str) -> str:
        """How a process ended, with its last line after an error; empty while it lives."""
        code = self._group.process(name).poll()
        if code is None:
            return ""
        words = self._group.last_words(name, ended=True) if code > 0 else ""
        return Ended(name, code).text + (f": {words}" if words else "")

    def _hang_of(self, spec: NodeSpec, now_s: float) -> str:
        """How long a process has hung; empty where it does not."""
        name = spec.name
        if not self._group.is_stopped(name):
            self._stopped_since.pop(name, None)
        elif now_s - self._stopped_since.setdefault(name, now_s) > STOPPED_S:
            return f"{name} was stopped (SIGSTOP) for {STOPPED_S:g} s"
        report, row = self._overseer.report_of(name), row_of(name)
        if (
            spec.loss == ENDS
            or row is None
            or not row.beats
            or report.received_s < self._began.get(name, 0.0)
        ):
            return ""
        if self._overseer.silent_s(report) > HANGS_S:
            return f"{name} has not reported for {HANGS_S:g} s and hangs"
        return ""

    def _lose(self, name: str, reason: str, now_s: float) -> None:
        due_s = self._times.setdefault(name, RestartTimes()).due(now_s)
        if due_s is not None:
            self._due[name] = (due_s, reason)
            return
        row = row_of(name)
        if row is not None and row.indispensable:
            raise RunFailed(f"{reason}; it was started {len(WAITS_S)} times within {WITHIN_S:g} s")
        self._left_out.add(name)
        self.restarts.append(Restart(name, reason, left_out=True))
        log_line(f"warning: {self.restarts[-1].warning}")

    def _start_again(self, name: str, reason: str, now_s: float) -> None:
        self._group.start_again(resumed(self._group.specs[name], self._overseer.report_of(name).values))
        del self._due[name]
        self._stopped_since.pop(name, None)
        self._times[name].note(now_s)
        self._began[name] = now_s
        self.restarts.append(Restart(name, reason))
        log_line(f"warning: {reason}; it is started again, and the robot goes on")
        self._on_restart(name, reason)


def resumed(spec: NodeSpec, said: dict[str, str]) -> NodeSpec:
    """The row of a node that goes on where the one before it was.

    Args:
        spec: Row of that one.
        said: Values of its last status.
    """
    row = row_of(spec.name)
    return replace(spec, parameters=spec.parameters | row.resume(said)) if row is not None else spec
