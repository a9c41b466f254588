"""One run of all tests: those with wall-clock deadlines first and alone, then the others in parallel."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import pytest
from xdist.scheduler import LoadFileScheduling

REAL_TIME = "real_time"  # the marker, and the name of the work that is theirs together
LIST, WRITER = "real_time_list", "gw0"  # where their names stand, and the process that writes them


class RealTimeFirst(LoadFileScheduling):  # type: ignore[misc]  # xdist has no types
    """Gives all real-time tests to one process, and nothing to the others until these are done; then file by file."""

    def __init__(self, config: pytest.Config, log: Any, names: Path) -> None:
        """Take the names of the real-time tests from a file, which is there once every process has collected."""
        super().__init__(config, log)
        self._names, self._real_time = names, frozenset[str]()

    def schedule(self) -> None:
        """Give out the first work."""
        if self.collection is None:
            self._real_time = frozenset(self._names.read_text(encoding="utf-8").splitlines())
        super().schedule()

    def mark_test_complete(self, node: Any, item_index: int, duration: float = 0) -> None:
        """Give out more work; with the last real-time test to all who have waited."""
        waited = self._waits
        super().mark_test_complete(node, item_index, duration)
        if waited and not self._waits:
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
            return
        super()._assign_work_unit(node)


class RealTimeFirstPlugin:
    """Lets `pytest -n N --dist loadfile` use it."""

    def __init__(self) -> None:
        """Make the folder of the list; it is removed with the plugin."""
        self._folder = tempfile.TemporaryDirectory(prefix="fulmar_tests_")
        self._names = Path(self._folder.name) / "names"

    @pytest.hookimpl(optionalhook=True)
    def pytest_configure_node(self, node: Any) -> None:
        """Tell a process where to write the names."""
        node.workerinput[LIST] = str(self._names)

    @pytest.hookimpl(optionalhook=True)
    def pytest_xdist_make_scheduler(self, config: pytest.Config, log: Any) -> RealTimeFirst | None:
        """Take the place of xdist's own scheduler by files."""
        return RealTimeFirst(config, log, self._names) if config.getoption("dist") == "loadfile" else None

    def pytest_collection_finish(self, session: pytest.Session) -> None:
        """Write the names, in a process that runs tests for others."""
        given: dict[str, str] = getattr(session.config, "workerinput", {})
        if given.get("workerid") == WRITER:
            names = [item.nodeid for item in session.items if item.get_closest_marker(REAL_TIME)]
            Path(given[LIST]).write_text("\n".join(names), encoding="utf-8")

    def pytest_unconfigure(self) -> None:
        """Remove the list."""
        self._folder.cleanup()
