"""`fulmar benchmark falcon`: one short flight, its keys and report, and what it refuses."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from fulmar_benchmarks.falcon import cells
from fulmar_core.tasks import load_task
from tests.fulmar_cli.command_line import complaint

FIGURES = {
    "rmse_per_axis_m", "rmse_m", "altitude_rmse_m", "settling_s", "peak_error_m", "energy", "survival", "episodes",
    "thesis",
}  # fmt: skip


@pytest.fixture
def brief(monkeypatch):
    """Flights of a second in the place of a minute, in this process."""
    monkeypatch.setattr(cells, "load_task", lambda name: replace(load_task(name), episode_s=1.0))
    monkeypatch.setattr("fulmar_benchmarks.pool.POOL", "")


def test_a_flight_has_the_stated_keys(fulmar, brief, tmp_path):
    words = ("--tasks", "a", "--controllers", "lqi", "--scenarios", "exact", "--episodes", 1)
    code, out, _ = fulmar(
        "benchmark", "falcon", *words, "--out", tmp_path / "falcon", "--no-report", "--json"
    )
    assert code == 0
    document = json.loads(out)
    assert set(document["tasks"]) == {"a"}
    assert set(document["tasks"]["a"]) == {"lqi"}
    assert set(document["tasks"]["a"]["lqi"]) == {"exact"}
    found = document["tasks"]["a"]["lqi"]["exact"]
    assert set(found) >= FIGURES
    assert found["episodes"] == 1
    assert found["survival"] == 1.0
    assert found["thesis"]["rmse_per_axis_m"] == 0.025
    assert found["rmse_per_axis_m"] == pytest.approx(found["rmse_m"] / np.sqrt(3.0))
    assert found["altitude_rmse_m"] <= found["rmse_m"] < 0.05
    assert 0.05 < found["energy"] < 0.5, "throttles are about 0.38 at one metre"
    saved = json.loads((tmp_path / "falcon" / "falcon.json").read_text(encoding="utf-8"))
    assert saved["tasks"] == document["tasks"]
    assert not list((tmp_path / "falcon").glob("*.html"))


@pytest.mark.slow
def test_a_report_is_a_page_of_errors_flights_and_ground_effect(fulmar, brief, tmp_path):
    words = ("--tasks", "a,hold", "--controllers", "lqi", "--scenarios", "exact,light", "--episodes", 2)
    code, out, _ = fulmar("benchmark", "falcon", *words, "--out", tmp_path / "falcon")
    assert code == 0
    assert "hold" in out
    (page,) = (tmp_path / "falcon").glob("*.html")
    text = page.read_text(encoding="utf-8")
    assert text.count("<svg") == 3
    assert "Ground effect" in text


def test_a_policy_that_is_not_shipped_is_left_out(fulmar, brief, tmp_path):
    words = ("--tasks", "f", "--controllers", "policy", "--scenarios", "exact", "--no-report")
    code, out, _ = fulmar(
        "benchmark", "falcon", "--robot", "navion", *words, "--out", tmp_path / "o", "--json"
    )
    assert code == 0
    assert json.loads(out)["tasks"] == {}


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("--tasks", "g"), "'g'"),
        (("--scenarios", "calmer"), "Did you mean 'calm'?"),
        (("--controllers", "lqx"), "'lqx'"),
        (
            ("--robot", "navien", "--tasks", "a", "--controllers", "lqi", "--scenarios", "exact"),
            "Did you mean 'navion'?",
        ),
    ],
)
def test_a_wrong_name_is_one_line(fulmar, brief, tmp_path, words, says):
    assert says in complaint(fulmar("benchmark", "falcon", *words, "--out", tmp_path / "o", "--json"))


def test_flights_that_were_flown_are_kept_and_a_benchmark_that_was_broken_off_goes_on(
    fulmar, brief, tmp_path
):
    words = ("--tasks", "a,d", "--controllers", "lqi", "--scenarios", "exact", "--no-report", "--json")
    again, moment = [], ("wall_s", "command")
    for folder in ("whole", "broken", "broken"):
        code, out, err = fulmar("benchmark", "falcon", *words, "--out", tmp_path / folder)
        assert code == 0
        again.append(({key: value for key, value in json.loads(out).items() if key not in moment}, err))
        (tmp_path / folder / "outcomes" / "airship_v7_d_lqi_exact.npz").unlink()
    for document, _ in again:
        for by in document["tasks"].values():
            by["lqi"]["exact"].pop("wall_s")
    assert again[0][0] == again[1][0] == again[2][0]
    assert again[2][1].count("evaluated before") == 1


def test_a_check_ends_with_one_where_something_is_not_met(fulmar, brief, tmp_path, monkeypatch):
    words = ("--tasks", "a", "--controllers", "lqi", "--scenarios", "exact", "--no-report", "--check")
    assert fulmar("benchmark", "falcon", *words, "--out", tmp_path)[0] == 0
    monkeypatch.setattr("fulmar_benchmarks.falcon.campaign.HALF", 0.0001)
    assert fulmar("benchmark", "falcon", *words, "--out", tmp_path)[0] == 1
