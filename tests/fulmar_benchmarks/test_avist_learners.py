"""Learners side by side: what counts as learned, and at which moment."""

from __future__ import annotations

import pytest

from fulmar_benchmarks.avist.learner_plots import plots_of
from fulmar_benchmarks.avist.learners import CLOSED, cells_of, document_of, tables_of
from fulmar_benchmarks.tables import Table
from fulmar_evaluation.report.style import as_png, house_style

CELLS = cells_of("cubesat_8", "track_velocities_3d", ("ppo", "dreamer"), seeds=2, samples=100, cpu_s=20.0)


def point(returns, samples, cpu_s):
    return {
        "returns": returns, "success_rate": 0.5, "samples": samples, "gradient_steps": 10, "cpu_s": cpu_s,
    }  # fmt: skip


@pytest.fixture
def found():
    curves = {
        "ppo_1": [point(100.0, 90, 1.0), point(310.0, 9000, 20.0)],
        "ppo_2": [point(120.0, 110, 1.0), point(290.0, 9000, 21.0)],
        "dreamer_1": [point(90.0, 50, 10.0), point(100.0, 100, 20.0)],
        # Its samples take longer than the processor time at which learners are compared.
        "dreamer_2": [point(100.0, 50, 10.0), point(230.0, 90, 20.0), point(900.0, 100, 40.0)],
    }
    closed = {f"track_velocities_3d_{CLOSED}": {"points": [{"returns": 150.0, "success_rate": 0.0}]}}
    return closed | {f"track_velocities_3d_{name}": {"points": curve} for name, curve in curves.items()}


def test_a_learner_has_learned_if_its_return_is_two_deviations_above_closed_valves(found):
    learners = document_of(CELLS, found)
    ppo, dreamer = learners["ppo"], learners["dreamer"]
    assert (ppo["return"], ppo["closed_valves"], ppo["learned"]) == (300.0, 150.0, True)
    assert (dreamer["return"], dreamer["learned"]) == (165.0, False), "above, but by less than its spread"
    assert (ppo["samples"], ppo["gradient_steps"], ppo["cpu_s"]) == (9000.0, 10.0, 20.5)
    assert (ppo["success_rate"], ppo["seeds"]) == (0.5, 2)


def test_equal_samples_are_the_nearest_check(found):
    ppo = document_of(CELLS, found)["ppo"]["equal_samples"]
    assert (ppo["return"], ppo["samples"], ppo["learned"]) == (110.0, 100.0, False)


def test_a_learner_that_could_not_run_has_a_reason(found):
    found |= {f"track_velocities_3d_dreamer_{seed}": "Run: make dreamer" for seed in (1, 2)}
    learners = document_of(CELLS, found)
    assert learners["dreamer"] == {"reason": "Run: make dreamer"}
    assert "dreamer: Run: make dreamer" in tables_of(learners, "track_velocities_3d")


def test_one_seed_says_nothing_of_a_spread(found):
    cells = cells_of("cubesat_8", "track_velocities_3d", ("ppo",), seeds=1, samples=100, cpu_s=20.0)
    assert document_of(cells, found)["ppo"]["learned"] is None


def test_a_table_for_each_budget_says_who_has_not_learned(found):
    tables = [
        each
        for each in tables_of(document_of(CELLS, found), "track_velocities_3d")
        if isinstance(each, Table)
    ]
    assert [table.title.rpartition(", ")[2] for table in tables] == ["equal processor time", "equal samples"]
    last = [[row.entries[0].text, row.entries[-1].text] for row in tables[0].rows]
    assert [each[1] for each in last] == ["learned", "not learned"]


def test_the_curves_are_a_small_plot(found):
    with house_style():
        (plot,) = plots_of(document_of(CELLS, found))
        assert 5_000 < len(as_png(plot.figure)) < 500_000
    assert plots_of({"dreamer": {"reason": "none"}}) == []
