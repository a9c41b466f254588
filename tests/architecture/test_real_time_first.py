"""The order of all tests of a run: those with wall-clock deadlines first and alone, then the others."""

from __future__ import annotations

from collections import deque
from pathlib import Path
from types import SimpleNamespace

import pytest

from tests.real_time_first import RealTimeFirst

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


def run(tmp_path: Path, collected: list[str], *, crashing: str = "") -> list[tuple[str, str]]:
    """Test and process of each step in which every process that can runs one test."""
    (tmp_path / "names").write_text("\n".join(name for name in collected if name in REAL_TIME))
    config = SimpleNamespace(
        getvalue=lambda _name: ["popen"] * 3,
        option=SimpleNamespace(loadscopereorder=True),
        hook=SimpleNamespace(),
    )
    scheduler = RealTimeFirst(config, None, tmp_path / "names")  # type: ignore[arg-type]
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
