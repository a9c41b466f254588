"""`fulmar benchmark all`: what it runs, what it keeps, and the page that it writes."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace

import pytest
from typer.main import get_command

from fulmar_benchmarks.campaign import run
from fulmar_benchmarks.catalogue import choice, rows
from fulmar_benchmarks.every.campaign import CommandCell
from fulmar_benchmarks.every.figures import rows_of
from fulmar_benchmarks.every.page import page_of
from fulmar_benchmarks.every.sizes import NAMES, SIZES, options
from fulmar_benchmarks.pool import measure_all
from fulmar_benchmarks.shape import HERE
from fulmar_cli.commands.benchmark import benchmark
from tests.fulmar_benchmarks.test_cluster import needs_ray
from tests.fulmar_benchmarks.test_shape import without_moment

DOCS = Path(__file__).parents[2] / "docs"
COMMANDS = get_command(benchmark).commands


def asked(out, **more):
    given = {"out": out, "size": "smoke", "only": "inertia,drift,recorder", "jobs": 3, "report": False}
    return rows()["all"].load()(choice("all", **given | more))


@pytest.fixture
def ran(monkeypatch):
    """Commands that were run: each prints a document, but for those of `ran.broken`, which raise."""
    ran = SimpleNamespace(words=[], more=[], broken={})

    def measure(cell, progress, pool=None):
        ran.words.append(" ".join(cell.words))
        ran.more.append(" ".join(cell.more))
        if cell.benchmark in ran.broken:
            raise ran.broken[cell.benchmark]
        checks = [{"name": "error", "measured": 0.5, "limit": 1.0, "met": True, "better": "less"}]
        return {"document": {"checks": checks}, "made": "2026-01-02 abc"}

    monkeypatch.setattr(CommandCell, "measure", measure)
    return ran


def test_every_benchmark_has_a_size_and_its_options_are_those_of_its_command():
    assert set(NAMES) == set(COMMANDS) - {"all"}
    for name in NAMES:
        for size in SIZES:
            COMMANDS[name].make_context(name, options(name, size), resilient_parsing=False)


def test_the_page_of_measured_figures_is_made_from_its_document():
    document = json.loads((DOCS / "benchmarks.json").read_text(encoding="utf-8"))
    assert (DOCS / "benchmarks.md").read_text(encoding="utf-8") == page_of(document)
    for section in document["sections"]:
        for row in section["rows"]:
            assert row["command"], f"{row['figure']}: name the command that repeats it"
            assert len(row["made"].split()) == 2, f"{row['figure']}: name day and revision"
            assert bool(row["published"]) == bool(row["source"])


def test_each_command_has_the_options_of_its_size_and_what_it_takes_of_ours(ran, tmp_path):
    run(asked(tmp_path, seed=7, ray="10.0.0.1:6379"))
    assert ran.words[0] == "fulmar benchmark drift --through batch --episodes 16 --no-report --seed 7"
    assert ran.words[2] == "fulmar benchmark recorder --parts lockstep,kills --kills 2 --lockstep-s 20"
    assert ran.more[1] == f"--jobs 3 --ray 10.0.0.1:6379 --out {tmp_path}/inertia"
    assert ran.more[2] == "", "it takes none of them"
    run(asked(tmp_path, only="inertia", resume=False))
    assert ran.more[-1].endswith("--fresh")


def test_a_benchmark_that_fails_costs_no_other_its_figures_and_is_alone_tried_again(ran, tmp_path):
    ran.broken = {"inertia": RuntimeError("no memory left")}
    broken = run(asked(tmp_path)).document
    texts = {section["title"]: section["text"] for section in broken["sections"]}
    assert texts == {
        "drift": "1 of 1 met.", "inertia": "Failed: RuntimeError: no memory left", "recorder": "1 of 1 met.",
    }  # fmt: skip
    assert (broken["met"], broken["asked"]) == (4, 5), "that it ran is required, too"
    ran.broken, ran.words = {}, []
    assert run(asked(tmp_path)).document["met"] == 6
    assert ran.words == ["fulmar benchmark inertia --satellites microsat --draws 1 --no-report --seed 2026"]


def test_one_that_was_interrupted_goes_on_and_gives_an_equal_document(ran, tmp_path):
    whole = run(asked(tmp_path / "whole"))
    ran.broken = {"inertia": KeyboardInterrupt()}
    with pytest.raises(KeyboardInterrupt):
        run(asked(tmp_path / "broken"))
    ran.broken, ran.words = {}, []
    again = run(asked(tmp_path / "broken"))
    assert without_moment(again.document) == without_moment(whole.document)
    assert [words.split()[2] for words in ran.words] == ["inertia", "recorder"]


def test_the_page_has_a_row_for_each_figure_with_its_command(ran, tmp_path):
    benchmark = asked(tmp_path, only="recorder")
    assert benchmark.tables(run(benchmark).document) == [
        "recorder    1 of 1 met.",
        f"page: {tmp_path}/page.md",
    ]
    command = "`fulmar benchmark recorder --parts lockstep,kills --kills 2 --lockstep-s 20`"
    row = f"| error | 0.5 | ≤ 1 (required) | yes | {command} | 2026-01-02 abc |"
    assert row in (tmp_path / "page.md").read_text().splitlines()


def test_a_command_that_prints_no_document_fails_with_its_last_words(tmp_path):
    cell = CommandCell(
        name="nothing", benchmark="nothing", words=("fulmar", "benchmark", "nothing"), where=HERE
    )
    found = []
    measure_all([cell], jobs=1, progress=lambda done: None, on_done=lambda _, figures: found.append(figures))
    assert "nothing" in found[0]
    assert "Traceback" not in found[0]


@pytest.mark.parametrize(
    ("words", "reported"),
    [
        (["--only", "inertai"], "unknown benchmark 'inertai'. Did you mean 'inertia'?"),
        (["--size", "tiny"], "unknown size 'tiny'"),
        pytest.param(["--ray", "127.0.0.1:1"], "Ray address 127.0.0.1:1 does not answer", marks=needs_ray),
    ],
)
def test_what_cannot_be_run_is_one_line_and_nothing_is_made(words, reported, fulmar, tmp_path):
    code, _, err = fulmar("benchmark", "all", *words, "--out", tmp_path / "out")
    assert (code, len(err.splitlines())) == (2, 1)
    assert reported in err
    assert not (tmp_path / "out").exists()


def figures(document):
    return [(row["figure"], row["ours"], row["published"], row["met"]) for row in rows_of(document)]


def test_published_figures_stand_beside_ours_then_what_is_required():
    entry = {"published": {"PT5": 64, "ALV": 0.08}, "figures": {"PT5": {"mean": 80.2}, "ALV": {"mean": 0.1}}}
    asks = {"row": "ideal", "controller": "policy", "figure": "PT5", "better": "more", "limit": 80}
    drift = {
        "benchmark": "drift",
        "rows": {"ideal": {"controllers": {"policy": entry}}},
        "requirements": [asks | {"measured": 80.2, "met": True}],
    }
    assert figures(drift) == [
        ("ideal, policy, PT5", "80.2", "64", True),
        ("ideal, policy, ALV", "0.1", "0.08", False),
        ("ideal, policy, PT5", "80.2", "≥ 80", True),
    ]
    assert rows_of(drift)[0]["source"] == "El-Hariry, Tables 3.5 and 3.6"
    pair = {
        "robot": "a",
        "task": "b",
        "thesis": {"success": 0.9, "goals": None},
        "ways": {"batch": {"success_rate": 1.0}},
    }
    assert figures({"benchmark": "roboran", "pairs": [pair]}) == [("a, b, success", "1", "0.9", True)]
    lqr = {"thesis": {"rmse_per_axis_m": 0.025, "crashed": False}, "rmse_per_axis_m": 0.01}
    assert figures({"tasks": {"a": {"lqi": {"exact": lqr}}}}) == [
        ("a, lqi, exact, rmse_per_axis_m", "0.01", "0.025", True)
    ]


def test_parts_that_only_pass_and_bare_figures_are_rows_too():
    assert figures({"loss": {"passed": True, "lost": 0}}) == [("loss", "passed", "passed", True)]
    required = {"required": [{"what": "p99", "limit": 20.0, "value": None, "passed": False}], "passed": False}
    assert figures(required) == [("p99", "", "20", False)]
    assert figures({"robots": {"a": {"batch_steps_per_s": 5.0}}}) == [("a, batch_steps_per_s", "5", "", None)]


def test_a_requirement_that_a_document_says_twice_is_one_row():
    check = {"name": "error", "measured": 0.5, "limit": 1.0, "met": True, "better": "less"}
    cell = {"name": "error", "required": 1.0, "share": 0.5, "met": True}
    assert len(rows_of({"checks": [check], "cells": [cell]})) == 1
