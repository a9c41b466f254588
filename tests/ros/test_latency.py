"""What `fulmar benchmark latency` and `endurance` measure, on systems that live for seconds."""

from __future__ import annotations

from pathlib import Path

import pytest

from fulmar_benchmarks.campaign import run
from fulmar_benchmarks.catalogue import choice
from fulmar_benchmarks.latency import cells, endurance
from fulmar_benchmarks.latency.cells import Latency
from fulmar_benchmarks.latency.endurance import Endurance, endure
from fulmar_core.config.errors import ConfigError

real_time = pytest.mark.real_time


@real_time
@pytest.mark.slow
def test_a_cell_states_latency_errors_of_the_period_and_what_each_node_uses() -> None:
    """rclpy's own executor, whose figures nothing is asked of, at 100 Hz."""
    cell = cells.latency_cell(100.0, False, "default", 1.0)
    row = cell.measure(lambda _done: None)
    assert row["failure"] is None
    assert row["answers"] > 100
    assert 0.0 < row["latency_ms"]["p50"] < 20.0
    assert row["controller_period_error_ms"]["p99"] is not None
    assert set(row["cpu_share"]) == {"plant", "controller", "recorder"}
    assert all(0.0 < share < 1.5 for share in row["cpu_share"].values())
    assert cells._required([row]) == []


@real_time
@pytest.mark.slow
def test_a_long_run_states_growth_of_memory_and_commands_that_the_bag_lacks(tmp_path: Path) -> None:
    figures = endure(simulated_s=10.0, rate=4.0, folder=tmp_path / "long", progress=lambda _done: None)
    assert figures["commands_lost"] == 0
    assert figures["commands_in_the_bag"] >= figures["commands_answered"] > 300
    assert set(figures["memory_growth_mb"]) == {"plant", "controller", "recorder"}
    assert all(size > 10.0 for size in figures["memory_mb"].values())


def test_idle_cells_come_first_and_loads_do_not_reach_into_them() -> None:
    asked = Latency(choice("latency", rates="5,50")).cells()
    assert len(asked) == 8
    assert [cell.loaded for cell in asked] == [False] * 4 + [True] * 4


@pytest.mark.parametrize("wrong", [{"rates": "0"}, {"rates": "fast"}, {"executors": "mine"}])
def test_rates_and_executors_that_do_not_exist_are_reported(wrong: dict[str, str]) -> None:
    with pytest.raises(ConfigError, match=next(iter(wrong)).removesuffix("s")):
        choice("latency", **wrong)


def test_cells_that_were_measured_are_kept_and_one_that_failed_is_measured_again(
    tmp_path, monkeypatch
) -> None:
    measured: list[float] = []

    def row(cell, seconds, folder):
        measured.append(cell.hz)
        if cell.hz == 10.0 and measured.count(10.0) == 1:
            return {"failure": "it ended", cells.AGAIN: True}
        spread = {"p50": 1.0, "p99": 2.0, "max": 3.0}
        return {
            "failure": None, "latency_ms": spread, "controller_period_error_ms": spread, "watchdog_trips": 0,
            "cpu_share": dict.fromkeys(cells.NODES, 0.1),
        }  # fmt: skip

    monkeypatch.setattr(cells, "_row", row)
    documents = [
        run(
            Latency(choice("latency", rates="10,50", executors="events", out=tmp_path, resume=resume))
        ).document
        for resume in (False, True, True)
    ]
    assert measured == [10.0, 50.0, 10.0, 50.0, 10.0]
    assert documents[0]["cells"][0]["failure"] == "it ended"
    assert documents[1]["cells"] == documents[2]["cells"]
    assert [check["met"] for check in documents[2]["checks"]] == [True, True]


def test_a_long_run_that_was_cut_off_is_run_again_beside_its_bag(tmp_path, monkeypatch) -> None:
    folders: list[Path] = []

    def endure(*, simulated_s, rate, folder, progress):
        folders.append(folder)
        (folder / "bag").mkdir(parents=True)
        if len(folders) == 1:
            raise KeyboardInterrupt
        return {"commands_lost": 0, "commands_answered": 9, "memory_growth_mb": {"plant": 0.0},
                "memory_mb": {"plant": 9.0}, "simulated_s": simulated_s, "rate": rate}  # fmt: skip

    monkeypatch.setattr(endurance, "endure", endure)
    asked = Endurance(choice("endurance", out=tmp_path))
    with pytest.raises(KeyboardInterrupt):
        run(asked)
    assert run(asked).document["commands_lost"] == 0
    assert folders == [tmp_path / "run_1", tmp_path / "run_2"]
