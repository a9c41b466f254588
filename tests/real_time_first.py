"""One run of all tests: those with wall-clock deadlines first, then the others in parallel.

Beside those with deadlines run, in the other processes, only tests that need no clock and start no nodes, and these
only get the processor time that is left: Linux runs what is SCHED_IDLE when nothing else wants to run (sched(7)). Where
a process may not come back from there, those with deadlines run alone.
"""

from __future__ import annotations

import contextlib
import os
import sys
import tempfile
import threading
from pathlib import Path
from typing import Any

import pytest
from xdist.scheduler import LoadFileScheduling

REAL_TIME = "real_time"  # the marker, and the name of the work that is theirs together
LIST, WRITER = "real_time_list", "gw0"  # where their names stand, and the process that writes them
OVER = ".over"  # ends the name of the file that is there once no real-time test is left
# Folders whose tests need no clock and start no nodes.
CORE = (
    "controllers", "dynamics", "estimators", "loop", "robots", "safety", "simulation", "states", "tasks", "worlds",
)  # fmt: skip
WAITING = ("tests/ros/", "tests/fulmar_ros/", "tests/fulmar_bringup/")
PATIENT = ("tests/contracts/", "tests/parity/", *(f"tests/fulmar_core/{folder}/" for folder in CORE))


def over_file(names: Path) -> Path:
    """The file that says that no real-time test is left; `names` is that of their names."""
    return names.with_name(names.name + OVER)


def take_priority(*, idle: bool) -> None:
    """Let this thread, and what it starts, run when nothing else wants to, or like others again."""
    wanted = os.SCHED_IDLE if idle else os.SCHED_OTHER
    if os.sched_getscheduler(0) != wanted:
        os.sched_setscheduler(0, wanted, os.sched_param(0))


def may_wait() -> bool:
    """Whether a process may run when nothing else wants to, and like others later: not all may come back."""
    if sys.platform != "linux":
        return False
    returned = []

    def there_and_back() -> None:
        with contextlib.suppress(OSError):
            take_priority(idle=True)
            take_priority(idle=False)
            returned.append(True)

    thread = threading.Thread(target=there_and_back)
    thread.start()
    thread.join()
    return bool(returned)


class RealTimeFirst(LoadFileScheduling):  # type: ignore[misc]  # xdist has no types
    """Gives all real-time tests to one process, and patient ones alone to the others until these are done."""

    def __init__(self, config: pytest.Config, log: Any, names: Path, *, beside: bool = False) -> None:
        """Take the names of the real-time tests from a file, which is there once every process has collected.

        Args:
            config: Of pytest.
            log: Takes what xdist says.
            names: The file.
            beside: Whether patient tests may run beside them.
        """
        super().__init__(config, log)
        self._names, self._beside, self._real_time = names, beside, frozenset[str]()

    def schedule(self) -> None:
        """Give out the first work."""
        if self.collection is None:
            self._real_time = frozenset(self._names.read_text(encoding="utf-8").splitlines())
            if not self._real_time:
                over_file(self._names).touch()
        super().schedule()
        self._spread()

    def mark_test_complete(self, node: Any, item_index: int, duration: float = 0) -> None:
        """Give out more work; with the last real-time test to all who have waited."""
        waited = self._waits
        super().mark_test_complete(node, item_index, duration)
        if waited and not self._waits:
            over_file(self._names).touch()
            self._go_on()

    def remove_node(self, node: Any) -> str | None:
        """Give what a process that ended had left to others, without the test in which it did: it would end them too.

        Returns:
            That test; None where nothing was left.
        """
        work: dict[str, dict[str, bool]] = self.assigned_work.pop(node)
        crashed = next((test for unit in work.values() for test, done in unit.items() if not done), None)
        if crashed is not None:
            work[self._split_scope(crashed)][crashed] = True
            self.workqueue.update({name: unit for name, unit in work.items() if not all(unit.values())})
            self._go_on()
        return crashed

    def _reschedule(self, node: Any) -> None:
        """Give a process more work; one that replaces another has none before it has collected."""
        if node in self.registered_collections:
            super()._reschedule(node)

    def _go_on(self) -> None:
        """Give everybody work; twice, since a process begins its last test when it knows of one more."""
        for _ in range(2):
            for node in self.nodes:
                self._reschedule(node)

    def _spread(self) -> None:
        """Spread files whose tests mostly wait, for nodes, among those that compute: processes are more than cores."""
        groups: dict[bool, list[str]] = {True: [], False: []}
        for unit in self.workqueue:
            groups[unit.startswith(WAITING)].append(unit)
        shares = {unit: at / len(units) for units in groups.values() for at, unit in enumerate(units)}
        for unit in sorted(shares, key=shares.__getitem__):
            self.workqueue.move_to_end(unit)

    def _split_scope(self, nodeid: str) -> str:
        return REAL_TIME if nodeid in self._real_time else str(super()._split_scope(nodeid))

    @property
    def _waits(self) -> bool:
        """Whether real-time tests are left."""
        work = (self.workqueue, *self.assigned_work.values())
        return any(not done for units in work for done in units.get(REAL_TIME, {}).values())

    def _assign_work_unit(self, node: Any) -> None:
        if REAL_TIME in self.workqueue:
            self.workqueue.move_to_end(REAL_TIME, last=False)
        elif self._waits and REAL_TIME not in self.assigned_work[node]:
            patient = next((unit for unit in self.workqueue if unit.startswith(PATIENT)), None)
            if not self._beside or patient is None:
                return
            self.workqueue.move_to_end(patient, last=False)
        super()._assign_work_unit(node)


class RealTimeFirstPlugin:
    """Lets `pytest -n N --dist loadfile` use it."""

    def __init__(self) -> None:
        """Make the folder of the list; it is removed with the plugin."""
        self._folder = tempfile.TemporaryDirectory(prefix="fulmar_tests_")
        self._names = Path(self._folder.name) / "names"
        self._beside = may_wait()

    @pytest.hookimpl(optionalhook=True)
    def pytest_configure_node(self, node: Any) -> None:
        """Tell a process where to write the names."""
        node.workerinput[LIST] = str(self._names)

    @pytest.hookimpl(optionalhook=True)
    def pytest_xdist_make_scheduler(self, config: pytest.Config, log: Any) -> RealTimeFirst | None:
        """Take the place of xdist's own scheduler by files."""
        if config.getoption("dist") != "loadfile":
            return None
        return RealTimeFirst(config, log, self._names, beside=self._beside)

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> None:
        """Let a test of a process for others wait for those with deadlines."""
        given: dict[str, str] = getattr(item.config, "workerinput", {})
        if LIST in given and self._beside:
            real_time = item.get_closest_marker(REAL_TIME) is not None
            take_priority(idle=not real_time and not over_file(Path(given[LIST])).exists())

    def pytest_collection_finish(self, session: pytest.Session) -> None:
        """Write the names, in a process that runs tests for others."""
        given: dict[str, str] = getattr(session.config, "workerinput", {})
        if given.get("workerid") == WRITER:
            names = [item.nodeid for item in session.items if item.get_closest_marker(REAL_TIME)]
            Path(given[LIST]).write_text("\n".join(names), encoding="utf-8")

    def pytest_unconfigure(self) -> None:
        """Remove the list."""
        self._folder.cleanup()
