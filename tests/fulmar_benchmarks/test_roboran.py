"""`fulmar benchmark roboran`, from the command line."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from fulmar_cli.main import app
from fulmar_core.config.errors import UnknownNameError

FEW = (
    "benchmark roboran --through batch --episodes 3 --no-report --robots floating_platform --tasks go_to_pose"
)


def run(words: str, *more: str):
    return CliRunner().invoke(app, [*words.split(), *more], catch_exceptions=False)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("benchmark")


@pytest.fixture(scope="module")
def evaluated(folder):
    return run(f"{FEW} --controllers policy,classical", "--out", str(folder), "--json")


def test_the_document_is_one_json_object_with_an_entry_for_each_pair(evaluated, folder):
    assert evaluated.exit_code == 0, evaluated.output
    document = json.loads(evaluated.stdout)
    assert json.loads((folder / "roboran.json").read_text()) == document
    assert (document["benchmark"], document["format"], document["episodes"]) == ("roboran", 1, {"batch": 3})
    policy, classical = document["pairs"]
    assert (policy["kind"], classical["kind"], classical["law"]) == ("policy", "classical", "lqr")
    for entry in (policy, classical):
        assert entry["status"] == "judged"
        assert entry["judged"]["batch"] == entry["ways"]["batch"]["success_rate"]
        assert entry["same_at_64_worlds"] is True
        assert entry["thesis"]["success"] == 0.99
        assert set(entry["ways"]["batch"]["time_to_target_s"]) == {"mean", "median", "p95"}
    assert {result["name"] for result in policy["verdicts"]} >= {"batch", "mujoco", "batch_minus_mujoco"}
    assert classical["verdicts"] == [], "nothing is asked of it"
    assert document["open"] == 1, "MuJoCo was left out"


def test_every_key_is_written_down(evaluated):
    text = (Path(__file__).parents[2] / "docs" / "evaluation.md").read_text()
    document = json.loads(evaluated.stdout)
    keys = {*document, *document["pairs"][0], *document["pairs"][0]["verdicts"][0]}
    assert [key for key in sorted(keys) if f"`{key}`" not in text] == []


def test_what_was_evaluated_before_is_taken_from_the_folder(evaluated, folder):
    again = run(f"{FEW} --controllers policy,classical", "--out", str(folder), "--json")
    timing = {"wall_s", "command"}
    first, second = json.loads(evaluated.stdout), json.loads(again.stdout)
    assert {k: v for k, v in first.items() if k not in timing} == {
        k: v for k, v in second.items() if k not in timing
    }
    assert again.stderr.count("evaluated before") == 2


def test_people_get_tables_with_what_is_missing_and_a_result(evaluated, folder, tmp_path):
    result = run(f"{FEW} --policies {tmp_path} --controllers policy,classical", "--out", str(folder))
    assert result.exit_code == 0, result.output
    assert "Go to pose, floating platform: missing: no policy is shipped" in result.stdout
    assert "floating platform, LQR" in result.stdout
    assert "time to target [s]" in result.stdout
    assert "0 of 1 pairs meet every requirement" in result.stdout


def test_a_check_that_cannot_be_met_ends_with_one(evaluated, folder):
    assert run(f"{FEW} --check", "--out", str(folder)).exit_code == 1


def test_unknown_names_are_refused_before_anything_is_evaluated(tmp_path):
    for option, name in (("--robots", "boat"), ("--through", "air"), ("--controllers", "hand")):
        with pytest.raises(UnknownNameError, match=name):
            run("benchmark roboran", option, name, "--out", str(tmp_path / "out"))
    assert not (tmp_path / "out").exists()
