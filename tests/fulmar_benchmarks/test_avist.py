"""`fulmar benchmark avist`: what it asks for, its document, and that it goes on where it was broken off."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fulmar_benchmarks.avist import generalists
from fulmar_benchmarks.avist.campaign import Avist, inspection_of, updates_of
from fulmar_benchmarks.avist.targets import LEAST_SUCCESS, of_inspection, of_live
from fulmar_benchmarks.campaign import run
from fulmar_benchmarks.catalogue import choice, rows
from fulmar_benchmarks.results import PairResult
from fulmar_benchmarks.shape import HERE
from fulmar_benchmarks.tables import Table
from fulmar_benchmarks.unit import TrialCell
from tests.fulmar_benchmarks.test_shape import without_moment

ROBOT = "spacecraft_16"  # stands in for the cubesat, whatever policies are there


class InThisProcess(Avist):
    """Where `quickly` stands for the measuring, which a pool's processes would not know."""

    def cells(self):
        return [replace(cell, where=HERE) for cell in super().cells()]


def asked(out: Path, **more) -> Avist:
    given = {
        "tasks": "go_to_pose_3d,track_velocities_3d",
        "controllers": "lqr,pd",
        "parts": "tasks",
        "episodes": 2,
    }
    return InThisProcess(choice("avist", robot=ROBOT, jobs=1, out=out, report=False, **given | more))


def result_of(cell: TrialCell, rate: float) -> PairResult:
    """As a trial gives it, of episodes that succeed at a rate."""
    count, nothing = cell.trial.episodes, np.zeros((cell.trial.episodes, 2))
    about = {
        "scenario": "nominal", "control_hz": 10.0, "episode_s": 60.0, "control_steps": 1, "wall_s": 1.0,
    }  # fmt: skip
    figures = {"final_position_error_m": np.full(count, 0.01), "effort": np.full(count, 0.1)}
    return PairResult(about, np.arange(count) < rate * count, figures, *([nothing] * 7))


def quickly(cell: TrialCell, progress, pool=None):
    """Measured without running anything; it waits where a file says so."""
    with (cell.bounds.parent / "notes").open("a") as file:
        file.write(f"{cell.name}\n")
    if (cell.bounds.parent / f"block_{cell.name}").exists():
        time.sleep(60.0)
    return dict(vars(result_of(cell, 1.0 if "lqr" in cell.name else 0.5)))


@pytest.fixture
def quick(monkeypatch):
    monkeypatch.setattr(TrialCell, "measure", quickly)


def test_the_document_has_laws_and_policies_by_task_and_what_is_required(quick, tmp_path):
    policies = tmp_path / "none"
    document = run(asked(tmp_path, controllers="all", policies=policies)).document
    assert set(document["laws"]) == {"go_to_pose_3d", "track_velocities_3d"}
    assert document["laws"]["go_to_pose_3d"]["lqr"]["success_rate"] == 1.0
    assert document["laws"]["go_to_pose_3d"]["pd"]["duty"] == pytest.approx(0.1)
    policy = document["policies"]["go_to_pose_3d"]
    assert (policy["success_rate"], policy["updates"], policy["cpu_s"]) == (None, None, None)
    assert policy["reason"] == f"there is no bundle: `fulmar policies {ROBOT}_go_to_pose_3d` makes it"
    met = {check["name"]: check["met"] for check in document["checks"]}
    assert met == {
        "go_to_pose_3d, lqr: success": True, "go_to_pose_3d, pd: success": False,
        "go_to_pose_3d, policy: success": None, "track_velocities_3d, policy: success": None,
    }  # fmt: skip
    assert "no number" in document["published_note"]


def test_the_page_shows_each_controller_and_why_one_is_missing(quick, tmp_path):
    benchmark = asked(tmp_path, controllers="all", policies=tmp_path / "none")
    table, *lines = benchmark.tables(run(benchmark).document)
    assert isinstance(table, Table)
    assert len(table.rows) == 6
    assert "there is no bundle" in lines[0]
    assert lines[-4].startswith("met      go_to_pose_3d, lqr")


def test_every_key_is_written_down(quick, tmp_path):
    text = (Path(__file__).parents[2] / "docs" / "evaluation.md").read_text()
    document = run(asked(tmp_path, controllers="all", policies=tmp_path / "none")).document
    keys = {*document, *document["policies"]["go_to_pose_3d"]}
    assert [key for key in sorted(keys) if f"`{key}`" not in text] == []


def test_a_benchmark_that_is_killed_goes_on_and_gives_an_equal_document(quick, tmp_path):
    whole = run(asked(tmp_path))
    broken = tmp_path / "broken"
    broken.mkdir()
    last = asked(broken).cells()[-1].name
    (broken / f"block_{last}").touch()
    process = subprocess.Popen([sys.executable, "-m", "tests.fulmar_benchmarks.test_avist", str(broken)])
    notes, until = broken / "notes", time.monotonic() + 60.0
    while time.monotonic() < until and not (notes.exists() and last in notes.read_text()):
        time.sleep(0.02)
    os.kill(process.pid, signal.SIGKILL)
    assert process.wait() == -signal.SIGKILL
    (broken / f"block_{last}").unlink()
    assert without_moment(run(asked(broken)).document) == without_moment(whole.document)
    measured = notes.read_text().split()
    assert len(measured) == 5, "only the last one was measured again"
    assert measured[-1] == measured[-2] == last


def test_success_through_nodes_stands_beside_that_in_mujoco():
    (check,) = of_live({"success_rate": 0.90}, {"success_rate": 0.86})
    assert (check.met, check.measured) == (False, pytest.approx(0.04))
    (check,) = of_live({"success_rate": None}, {"success_rate": 0.86})
    assert check.met is None
    assert of_live(None, {"success_rate": 0.86}) == []


def test_updates_are_those_of_the_passport_or_follow_from_its_steps():
    settings = {"worlds": 1024, "algorithm": {"kind": "ppo", "steps": 16}}
    assert updates_of({"updates": 150, "steps": 1}) == 150
    assert updates_of({"steps": 120 * 16384, "settings": settings}) == 120
    assert updates_of({"steps": 5000, "settings": {"worlds": 8, "algorithm": {"kind": "td3"}}}) is None
    assert updates_of({}) is None


def test_laws_and_policies_of_the_cubesat_have_the_limits_that_were_asked_for():
    assert LEAST_SUCCESS["go_to_pose_3d", "pd"] == LEAST_SUCCESS["go_to_pose_3d", "lqr"] == 0.99
    assert LEAST_SUCCESS["follow_pose_3d", "policy"] == 0.85


def inspected(**more):
    """Figures of a law on one path, in order unless said otherwise."""
    good = {
        "success_rate": 1.0, "path_error_m": {"mean": 0.005, "max": 0.01}, "pointing_error_deg": {"mean": 0.1},
        "least_distance_m": 0.4, "coverage": None, "coverage_possible": None, "reason": None,
    }  # fmt: skip
    return good | more


def test_the_worst_path_of_a_law_counts_and_a_policy_only_has_to_keep_out():
    bad = inspected(path_error_m={"mean": 0.02, "max": 0.04})
    near = inspected(least_distance_m=-0.1, path_error_m={"mean": 0.5, "max": 1.0})
    found = {
        "gateway": {"circle": {"pd": inspected(), "policy": near}, "line": {"pd": bad, "policy": inspected()}}
    }
    checks = {check.name: (check.measured, check.met) for check in of_inspection(found)}
    assert checks == {
        "inspect, pd: path_error_m, mean": (0.02, False), "inspect, pd: path_error_m, max": (0.04, True),
        "inspect, pd: pointing_error_deg, mean": (0.1, True),
        "inspect, pd: least distance from a keep-out volume [m]": (0.4, True),
        "inspect, policy: least distance from a keep-out volume [m]": (-0.1, False),
    }  # fmt: skip


def test_a_path_that_was_not_flown_leaves_its_requirements_open():
    found = {"iss": {"circle": {"lqr": inspected()}, "line": {"lqr": inspection_of("too fast")}}}
    assert {check.met for check in of_inspection(found)} == {None}


def test_a_round_is_asked_for_about_each_thing_along_each_path_for_as_long_as_it_takes():
    given = {
        "parts": "inspect",
        "controllers": "pd",
        "things": "gateway,iss",
        "paths": "line,circle",
        "rounds": 3,
    }
    cells = Avist(choice("avist", jobs=1, **given)).cells()
    assert [cell.name for cell in cells] == [
        "inspect_gateway_circle_pd", "inspect_gateway_line_pd", "inspect_iss_circle_pd", "inspect_iss_line_pd",
    ]  # fmt: skip
    trial = cells[0].trial
    assert (trial.plan.thing, trial.plan.along, trial.episodes) == ("gateway", "circle", 3)
    assert trial.task.thing == "gateway"
    assert trial.plan.duration_s == trial.task.episode_of(trial.robot) > cells[1].trial.plan.duration_s


def test_figures_of_rounds_are_means_and_the_worst_and_what_was_not_computed_is_left_out():
    nothing = np.zeros((2, 2))
    figures = {
        "path_error_m": np.array([0.01, 0.03]), "path_error_most_m": np.array([0.05, 0.02]),
        "pointing_error_deg": np.array([1.0, 2.0]), "least_distance_m": np.array([0.3, 0.2]),
        "coverage": np.array([0.4, np.nan]),
    }  # fmt: skip
    found = inspection_of(PairResult({}, np.array([True, False]), figures, *([nothing] * 7)))
    assert found == {
        "success_rate": 0.5, "path_error_m": {"mean": 0.02, "max": 0.05}, "pointing_error_deg": {"mean": 1.5},
        "least_distance_m": 0.2, "coverage": 0.4, "coverage_possible": None, "episodes": 2, "reason": None,
    }  # fmt: skip


LEARNT = {"updates": 3, "cpu_s": 1.5, "steps": 9}


def test_generalists_stand_beside_policies_of_the_same_path_or_body_alone(tmp_path):
    cells = generalists.cells_of("cubesat_8", "gateway", ("circle", "line"), 3, tmp_path)
    assert [cell.name for cell in cells] == [
        "inspect_all_3", "inspect_circle_3", "inspect_line_3", "body_any_3", "body_nominal_3", "body_0_3", "body_1_3",
    ]  # fmt: skip

    def on(cell):
        if isinstance(cell, generalists.PathsCell):
            return {path: {"success_rate": 0.9 if cell.path else 0.8} for path in cell.paths}
        return (
            {"random": 0.7}
            if cell.body == ""
            else {"random": 0.6}
            if cell.body == "nominal"
            else {cell.body: 1.0}
        )

    found = {cell.name: LEARNT | {"on": on(cell)} for cell in cells}
    document = generalists.document_of(cells, found)
    assert document["paths"]["line"] == {
        "generalist": {"success_rate": 0.8}, "single": {"success_rate": 0.9},
    }  # fmt: skip
    assert document["bodies"] == {
        "random": {"generalist": 0.7, "single": 0.6}, "0": {"single": 1.0}, "1": {"single": 1.0},
    }  # fmt: skip
    assert document["learning"]["body_any_3"] == LEARNT
    assert generalists.behind(document) == {"paths": pytest.approx(0.1), "bodies": pytest.approx(-0.1)}


def test_a_run_that_failed_is_named_and_leaves_its_place_empty(tmp_path):
    cells = generalists.cells_of("cubesat_8", "gateway", ("circle",), 3, tmp_path)[:2]
    found = {
        cells[0].name: "RunFailed: no",
        cells[1].name: LEARNT | {"on": {"circle": {"success_rate": 1.0}}},
    }
    document = generalists.document_of(cells, found)
    assert document["learning"]["inspect_all_3"] == {"error": "RunFailed: no"}
    assert generalists.behind(document) == {"paths": None, "bodies": None}


def test_single_policies_learn_with_one_path_or_body_and_generalists_with_all(tmp_path):
    pytest.importorskip("torch")
    cells = {
        cell.name: cell
        for cell in generalists.cells_of("cubesat_8", "gateway", ("circle", "line"), 3, tmp_path)
    }
    one, every = (cells[name].learned()[1].training_paths for name in ("inspect_line_3", "inspect_all_3"))
    assert (one, every) == (("line",), ("circle", "line"))
    own, other, any_body = (cells[f"body_{name}_3"].learned() for name in ("nominal", "0", "any"))
    assert (own[2].scenario, own[2].body_inputs) == ("nominal", False)
    assert (any_body[2].scenario, any_body[2].body_inputs) == ("morphologies", True)
    assert own[0].body.mass == any_body[0].body.mass != other[0].body.mass
    assert all(each[2].action_space == "wrench" for each in (own, other, any_body))


def test_a_benchmark_without_learning_asks_for_no_torch():
    needs = rows()["avist"].needs
    assert "torch" not in needs(choice("avist", parts="tasks,inspect"))
    assert "torch" in needs(choice("avist", parts="generalists"))


if __name__ == "__main__":
    TrialCell.measure = quickly  # type: ignore[method-assign]
    run(asked(Path(sys.argv[1])))
