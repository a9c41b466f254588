"""What `fulmar benchmark latency` and `endurance` measure, on systems that live for seconds."""

from __future__ import annotations

from pathlib import Path

import pytest

from fulmar_benchmarks.latency.cells import Cell, cells_of, measure
from fulmar_benchmarks.latency.endurance import endure
from fulmar_cli.commands.benchmark_latency import latency
from fulmar_core.config.errors import ConfigError

real_time = pytest.mark.real_time


@real_time
@pytest.mark.slow
def test_a_cell_states_latency_errors_of_the_period_and_what_each_node_uses() -> None:
    """rclpy's own executor, whose figures nothing is asked of, at 100 Hz."""
    figures = measure([Cell(100.0, False, "default")], 1.0, lambda _done: None)
    (row,) = figures["cells"]
    assert row["failure"] is None
    assert row["answers"] > 100
    assert 0.0 < row["latency_ms"]["p50"] < 20.0
    assert row["controller_period_error_ms"]["p99"] is not None
    assert set(row["cpu_share"]) == {"plant", "controller", "recorder"}
    assert all(0.0 < share < 1.5 for share in row["cpu_share"].values())
    assert figures["required"] == []


@real_time
@pytest.mark.slow
def test_a_long_run_states_growth_of_memory_and_commands_that_the_bag_lacks(tmp_path: Path) -> None:
    figures = endure(simulated_s=10.0, rate=4.0, folder=tmp_path / "long", progress=lambda _done: None)
    assert figures["commands_lost"] == 0
    assert figures["commands_in_the_bag"] >= figures["commands_answered"] > 300
    assert set(figures["memory_growth_mb"]) == {"plant", "controller", "recorder"}
    assert all(size > 10.0 for size in figures["memory_mb"].values())


def test_idle_cells_come_first_and_loads_do_not_reach_into_them() -> None:
    cells = cells_of((5.0, 50.0), ("events", "default"))
    assert len(cells) == 8
    assert [cell.loaded for cell in cells] == [False] * 4 + [True] * 4


@pytest.mark.parametrize("wrong", [{"rates": "0"}, {"rates": "fast"}, {"executors": "mine"}])
def test_rates_and_executors_that_do_not_exist_are_reported(wrong: dict[str, str]) -> None:
    with pytest.raises(ConfigError, match=next(iter(wrong))):
        latency(**{"rates": "50", "seconds": 1.0, "executors": "events", "as_json": False, **wrong})
