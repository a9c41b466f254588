"""`fulmar benchmark drift`: the command, its document, its table and its report."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import pytest
from rich.console import Console
from typer.testing import CliRunner

from fulmar_benchmarks.drift.cells import path_lines, pose_lines, shown, unmet
from fulmar_benchmarks.drift.conditions import CONDITIONS, CONTROLLERS, PATHS, ROWS
from fulmar_benchmarks.drift.targets import (
    BANDS,
    FIGURES,
    REQUIRED,
    TRACKING,
    band_of,
    drop_percent,
    published,
    requirements,
)
from fulmar_benchmarks.selectors import Selector, read_names
from fulmar_benchmarks.tables import BAD, GOOD, print_shown
from fulmar_cli.main import app
from fulmar_core.config.errors import UnknownNameError
from fulmar_core.worlds.scenario import load_scenario

KNOWN = ("policy", "lqr", "mpc")
FEW = "benchmark drift --through batch --controllers lqr --episodes 3 --rows ideal,two_lost,square --jobs 1"


def run(words: str, *more: str):
    return CliRunner().invoke(app, [*words.split(), *more], catch_exceptions=False)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("drift")


@pytest.fixture(scope="module")
def evaluated(folder):
    result = run(FEW, "--output", str(folder), "--json", "--no-report")
    assert result.exit_code == 0, result.output
    return result


@pytest.fixture(scope="module")
def document(evaluated):
    return json.loads(evaluated.stdout)


def test_the_document_has_rows_of_controllers_of_figures(document, folder):
    assert json.loads((folder / "drift.json").read_text()) == document
    assert (document["benchmark"], document["format"], document["through"]) == ("drift", 1, "batch")
    assert list(document["rows"]) == ["ideal", "two_lost", "square"]
    entry = document["rows"]["ideal"]["controllers"]["lqr"]
    assert (entry["status"], entry["episodes"], entry["control_steps"]) == ("judged", 3, 750)
    assert set(entry["figures"]) == set(FIGURES)
    assert set(entry["figures"]["PT5"]) == {"mean", "median", "p5", "p95"}
    assert entry["published"]["PT5"] == 73
    assert len(entry["sha256"]) == 64
    square = document["rows"]["square"]["controllers"]["lqr"]["figures"]
    assert 0.0 < square["velocity_error"]["mean"] < 0.1
    assert square["path_error_most"]["mean"] > square["path_error"]["mean"]


def test_bounds_and_feasibility_stand_in_the_row(document):
    ideal, lost = document["rows"]["ideal"], document["rows"]["two_lost"]
    assert 80.0 < ideal["bound"]["PT5"]["mean"] < 88.0
    assert ideal["bound"]["PT1"]["mean"] < ideal["bound"]["PT5"]["mean"]
    assert ideal["feasible_share"] == 1.0 > lost["feasible_share"]


def test_every_key_is_written_down(document):
    text = (Path(__file__).parents[2] / "docs" / "evaluation.md").read_text()
    pose, path = document["rows"]["ideal"], document["rows"]["square"]
    keys = {*document, *pose, *path, *document["requirements"][0]}
    keys |= {*pose["controllers"]["lqr"], *path["controllers"]["lqr"], *path["controllers"]["lqr"]["figures"]}
    assert [key for key in sorted(keys) if f"`{key}`" not in text] == []


def test_what_was_evaluated_before_is_taken_from_the_folder(document, folder):
    again = run(FEW, "--output", str(folder), "--json", "--no-report")
    assert again.stderr.count("evaluated before") == 3
    timing = {"wall_s", "command"}
    assert {k: v for k, v in json.loads(again.stdout).items() if k not in timing} == {
        k: v for k, v in document.items() if k not in timing
    }


def test_a_controller_that_cannot_drive_is_reported_with_its_reason(tmp_path):
    words = "benchmark drift --through batch --controllers policy --episodes 1 --rows ideal --no-report"
    result = run(words, "--policy", str(tmp_path / "none"), "--out", str(tmp_path))
    assert result.exit_code == 0, result.output
    assert "policy: missing: no policy is shipped" in result.stdout
    assert "0 of 7 figures that are required are met; 7 could not be evaluated." in result.stdout
    assert run(f"{words} --check", "--policy", str(tmp_path / "none"), "--out", str(tmp_path)).exit_code == 1


def test_unknown_names_are_refused_before_anything_is_evaluated(tmp_path):
    for option, name in (("--rows", "storm"), ("--through", "air"), ("--controllers", "hand")):
        with pytest.raises(UnknownNameError, match=name):
            run("benchmark drift", option, name, "--out", str(tmp_path / "out"))
    assert not (tmp_path / "out").exists()


@pytest.mark.slow  # tests/fulmar_benchmarks/test_report.py draws others of its kind
def test_the_report_stands_alone_and_its_plots_are_small(document, folder):
    assert run(FEW, "--output", str(folder)).exit_code == 0
    text = (folder / "index.html").read_text()
    assert not re.search(r'@import|url\((?!#)|src="http|href="http', text)
    for words in ("Go to pose under disturbances", "2 thrusters lost", "bound", "Square", "0–20 %"):
        assert words in text
    plots = {path.stem: path for path in (folder / "pictures").iterdir()}  # word: folder of reports
    assert set(plots) == {"at_a_glance", "over_time", "conditions_over_time", "starts", "paths"}
    for path in plots.values():
        assert path.read_bytes().startswith(b"\x89PNG")
        assert path.stat().st_size < 500_000
    assert text.count("<svg") == len(plots)


def test_drops_are_shares_of_the_ideal_figure_whichever_way_is_better():
    assert drop_percent("PT5", 32.0, 64.0) == pytest.approx(50.0)
    assert drop_percent("PT5", 70.0, 64.0) == 0.0
    assert drop_percent("AAS", 0.15, 0.10) == pytest.approx(50.0)
    assert drop_percent("AAV", 0.49, 0.16) == 100.0
    assert drop_percent("OT1", 1.0, 0.0) is None


def test_bands_are_those_of_the_thesis():
    assert [band.name for band in BANDS] == ["blue", "green", "yellow", "red", "purple"]
    drops = (0.0, 20.0, 20.1, 40.0, 59.0, 80.0, 80.1, 100.0)
    names = ["blue", "blue", "green", "green", "yellow", "red", "purple", "purple"]
    assert [band_of(drop).name for drop in drops] == names


def test_published_tables_have_every_row_and_every_scenario_exists():
    for condition in CONDITIONS:
        load_scenario(condition.scenario)
        for controller in ("policy", "lqr", "mpc"):
            assert set(published(condition.name, controller)[1]) == set(FIGURES)
    assert [published("torque", name)[0] for name in ("policy", "lqr")] == ["RL", "LQR"]
    assert published("torque", "mpc") == published("torque", "lqr") != published("torque", "policy")
    assert set(TRACKING) == {path.name for path in PATHS}
    assert all(row in ROWS for rows in REQUIRED.values() for row in rows)
    assert set(REQUIRED) == set(CONTROLLERS)


def test_a_figure_meets_what_is_asked_on_its_own_side_of_the_limit():
    gas = next(one for one in requirements("ideal", "policy") if one.figure == "AAS")
    place = next(one for one in requirements("ideal", "policy") if one.figure == "PT5")
    assert (gas.check(0.09).met, gas.check(0.0901).met) == (True, False)
    assert (place.check(80.0).met, place.check(79.96).met, place.check(None).met) == (True, False, None)


def test_the_table_marks_what_is_met_and_colours_what_is_lost(document):
    changed = json.loads(json.dumps(document))
    for check in changed["requirements"]:
        check["met"] = check["figure"] != "PT1"
    lines = pose_lines(changed)
    ours = next(line for line in lines if line.row == "ideal" and line.kind == "ours")
    tones = dict(zip(FIGURES, (cell.tone for cell in ours.cells), strict=True))
    assert (tones["PT5"], tones["PT1"], tones["ALV"]) == (GOOD, BAD, "")
    published_lost = next(line for line in lines if line.row == "two_lost" and line.kind == "published")
    assert dict(zip(FIGURES, published_lost.cells, strict=True))["PT5"].band == "purple"  # 73 to 12
    assert [line.kind for line in lines if line.row == "ideal"] == ["ours", "published", "bound"]
    assert len(unmet(changed)) == 1
    assert unmet(changed)[0].startswith("Ideal, LQR: PT1 ")
    assert [line.kind for line in path_lines(changed)] == ["ours", "published"]


def test_episodes_whose_pose_can_be_held_are_reported_beside_all(document):
    changed = json.loads(json.dumps(document))
    row = changed["rows"]["two_lost"]
    where = {figure: {"mean": 50.0} for figure in FIGURES}
    row["feasible_share"], row["controllers"]["lqr"]["where_feasible"] = 0.5, {"figures": where}
    lines = [line for line in pose_lines(changed) if line.row == "two_lost"]
    assert [line.kind for line in lines] == ["ours", "feasible", "published", "bound"]
    assert (lines[1].controller, lines[1].cells[0].text) == ("feasible 50 %", "50")


def test_people_get_both_tables_with_marks_and_a_result(document, capsys):
    print_shown(shown(document), Console(highlight=False), 170)
    text = capsys.readouterr().out
    for words in (
        "Go to pose under disturbances",
        "DRIFT's LQR",
        "Paths followed",
        "±",
        "figures that are required",
    ):
        assert words in text
    assert "✓" in text or "✗" in text


def test_controllers_are_evaluated_in_the_order_that_was_given():
    given = Selector(
        "controllers", "K,...", "", family="controller", known=f"{__name__}:KNOWN", as_given=True
    )
    assert read_names("mpc,policy", given) == ("mpc", "policy")
    assert read_names("mpc,policy", replace(given, as_given=False)) == ("policy", "mpc")
    assert read_names("all", given) == KNOWN
