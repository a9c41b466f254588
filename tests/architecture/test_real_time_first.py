"""The order of all tests: those with wall-clock deadlines first, only patient ones beside them, then the others."""

from __future__ import annotations

import os
from collections import deque
from pathlib import Path
from types import SimpleNamespace

import pytest

from tests.real_time_first import RealTimeFirst, RealTimeFirstPlugin, may_wait, over_file

REAL_TIME = [f"tests/ros/test_{file}.py::test_r{number}" for file in "ab" for number in range(3)]
OTHERS = [
    f"tests/{folder}/test_{file}.py::test_{n}"
    for folder in ("ros", "core")
    for file in "abc"
    for n in range(4)
]
SINGLE = "tests/core/test_single.py::test_alone"
COLLECTED = [*OTHERS, SINGLE, *REAL_TIME]


class Process:
    """Runs tests as a worker of xdist: one only when it knows of the next, or that there is none."""

    def __init__(self, name: str) -> None:
        self.gateway = SimpleNamespace(id=name)
        self.shutting_down = False
        self.waiting: deque[int] = deque()

    def send_runtest_some(self, indices: list[int]) -> None:
        self.waiting.extend(indices)

    def shutdown(self) -> None:
        self.shutting_down = True

    @property
    def next(self) -> int | None:
        ready = len(self.waiting) > 1 or (self.waiting and self.shutting_down)
        return self.waiting[0] if ready else None


def run(
    tmp_path: Path, collected: list[str], *, crashing: str = "", beside: bool = True
) -> list[tuple[str, str]]:
    """Test and process of each step in which every process that can runs one test."""
    (tmp_path / "names").write_text("\n".join(name for name in collected if name in REAL_TIME))
    config = SimpleNamespace(
        getvalue=lambda _name: ["popen"] * 3,
        option=SimpleNamespace(loadscopereorder=True),
        hook=SimpleNamespace(),
    )
    scheduler = RealTimeFirst(config, None, tmp_path / "names", beside=beside)  # type: ignore[arg-type]
    for name in ("gw0", "gw1", "gw2"):
        process = Process(name)
        scheduler.add_node(process)
        scheduler.add_node_collection(process, collected)
    scheduler.schedule()
    done: list[tuple[str, str]] = []
    while able := [process for process in scheduler.nodes if process.next is not None]:
        for process in able:
            index = process.waiting.popleft()
            done.append((collected[index], process.gateway.id))
            if collected[index] == crashing:
                assert scheduler.remove_node(process) == crashing
            else:
                scheduler.mark_test_complete(process, index)
        if scheduler.tests_finished:
            for process in scheduler.nodes:
                process.shutdown()
    return done


@pytest.mark.parametrize("crashing", ["", REAL_TIME[2], REAL_TIME[-1], OTHERS[5]])
def test_real_time_tests_come_first_in_one_process_and_every_test_comes_once(
    crashing: str, tmp_path: Path
) -> None:
    """Also where a test ends its process: others go on without it."""
    done = run(tmp_path, COLLECTED, crashing=crashing)
    names = [name for name, _ in done]
    assert sorted(names) == sorted(COLLECTED)
    assert set(names[: len(REAL_TIME)]) == set(REAL_TIME)
    alone = [process for name, process in done if name in REAL_TIME]
    assert len(set(alone)) == (2 if crashing in REAL_TIME[:-1] else 1)
    assert len({process for name, process in done if name in OTHERS}) >= 2


@pytest.mark.parametrize("collected", [REAL_TIME, REAL_TIME[:1], OTHERS, [SINGLE], [SINGLE, REAL_TIME[0]]])
def test_a_part_of_all_tests_runs_to_its_end(collected: list[str], tmp_path: Path) -> None:
    assert sorted(name for name, _ in run(tmp_path, collected)) == sorted(collected)


def test_files_whose_tests_wait_for_nodes_are_spread_among_the_others(tmp_path: Path) -> None:
    waiting = [f"tests/ros/test_{n}.py::test_it" for n in range(6)]
    computing = [f"tests/core/test_{n:02}.py::test_{m}" for n in range(12) for m in range(3)]
    names = [name for name, _ in run(tmp_path, [*waiting, *computing])]
    places = [names.index(name) / len(names) for name in waiting]
    assert min(places) < 0.4 < 0.6 < max(places)


PATIENT = [f"tests/contracts/test_{file}.py::test_{n}" for file in "abcd" for n in range(3)]


@pytest.mark.parametrize(
    ("crashing", "beside"),
    [("", True), (REAL_TIME[2], True), (PATIENT[4], True), ("", False), (REAL_TIME[2], False)],
)
def test_only_tests_that_need_no_clock_run_beside_those_that_do(
    crashing: str, beside: bool, tmp_path: Path
) -> None:
    done = run(tmp_path, [*COLLECTED, *PATIENT], crashing=crashing, beside=beside)
    names = [name for name, _ in done]
    assert sorted(names) == sorted([*COLLECTED, *PATIENT])
    last = max(names.index(name) for name in REAL_TIME)
    early = set(names[:last]) - set(REAL_TIME)
    assert early <= set(PATIENT)
    assert bool(early) == beside
    assert over_file(tmp_path / "names").exists()


def test_a_test_beside_them_waits_for_them_until_none_is_left(
    tmp_path: Path,
) -> None:
    if not may_wait():
        pytest.skip("this process may not come back from SCHED_IDLE")
    plugin = RealTimeFirstPlugin()
    config = SimpleNamespace(workerinput={"real_time_list": str(tmp_path / "names")})

    def priority_of(marker: str | None) -> int:
        marked = SimpleNamespace(config=config, get_closest_marker=lambda name: marker == name or None)
        plugin.pytest_runtest_protocol(marked)  # type: ignore[arg-type]
        return os.sched_getscheduler(0)

    try:
        assert priority_of(None) == os.SCHED_IDLE
        assert priority_of("real_time") == os.SCHED_OTHER
        assert priority_of(None) == os.SCHED_IDLE
        over_file(tmp_path / "names").touch()
        assert priority_of(None) == os.SCHED_OTHER
    finally:
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
        plugin.pytest_unconfigure()
