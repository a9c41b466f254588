"""What commands answer: help, tables for people, and one JSON object for scripts."""

from __future__ import annotations

import json
import re
import sys
from importlib.metadata import version
from pathlib import Path

import pytest

from fulmar_evaluation import run_outcome
from tests.fulmar_cli.command_line import EVALUATE, RUN, SHIPPED


def test_the_doctor_names_the_extra_of_a_part_that_is_not_installed(fulmar, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    code, out, _ = fulmar("doctor", "--json")
    assert code == 1
    (finding,) = (each for each in json.loads(out)["findings"] if each["what"] == "matplotlib")
    assert finding["level"] == "wrong"
    assert "'view'" in finding["fix"]
    assert finding["advice"] == finding["fix"]


def test_without_a_command_the_help_is_shown_as_bad_usage(fulmar):
    code, out, err = fulmar()
    assert (code, out) == (2, "")
    assert err.lstrip().startswith("Usage: fulmar")


def test_the_version_is_that_of_the_distribution(fulmar):
    assert fulmar("--version") == (0, f"fulmar {version('fulmar')}\n", "")


@pytest.mark.parametrize("words", [["--help"], ["run", "--help"], ["bundle", "show", "--help"]])
def test_help_is_no_mistake(fulmar, words):
    code, out, err = fulmar(*words)
    assert (code, err) == (0, "")
    assert "Usage: fulmar" in out


@pytest.mark.parametrize(("command", "option"), [("run", "--goal"), ("run", "--start"), ("goals", "--pose")])
def test_the_help_of_a_goal_gives_the_numbers_in_space(fulmar, command, option):
    _, out, _ = fulmar(command, "--help")
    words = out.partition(f"\n  {option} ")[2].partition("\n  -")[0].split()
    assert {"x,y,z", "x,y,z,roll,pitch,yaw"} <= {word.strip(";.") for word in words}
    assert "[m, deg]" in " ".join(words)


def test_the_list_shows_every_family_for_people(fulmar):
    code, out, err = fulmar("list")
    assert (code, err) == (0, "")
    for word in (
        "robots",
        "floating_platform",
        "go_to_position",
        "lqr",
        "mujoco_policy",
        "floating_platform_go_to_pose",
    ):
        assert word in out


def test_the_list_is_one_json_object(fulmar):
    code, out, err = fulmar("list", "--json")
    assert (code, err) == (0, "")
    found = json.loads(out)
    assert list(found) == [
        "robots", "tasks", "controllers", "systems", "policies", "goals", "hardware", "scenarios", "estimators",
        "things",
    ]  # fmt: skip
    assert "nominal" in found["scenarios"] and "gateway" in found["things"]
    assert found["controllers"] == [
        "policy",
        "lqr",
        "lqi",
        "mppi",
        "pid",
        "pd",
        "adaptive",
        "mpc",
        "lqr_drift",
        "classical",
        "excite",
        "external",
    ]
    tasks = json.loads(fulmar("list", "tasks", "--json")[1])["tasks"]
    assert {"go_to_pose", "go_to_position", "go_through_positions", "track_velocities"} <= set(tasks)


@pytest.mark.parametrize("controller", ["lqr", "policy"])
def test_an_evaluation_is_one_json_object_with_every_figure(fulmar, controller):
    words = ["evaluate", "floating_platform", "go_to_pose", "--controller", controller, "--through", "batch"]
    code, out, _ = fulmar(*words, "--episodes", "4", "--seed", "5", "--json")
    assert code == 0
    found = json.loads(out)
    assert (found["episodes"], found["seed"], found["control_hz"]) == (4, 5, 5.0)
    assert 0.0 <= found["success_rate"] <= 1.0
    for name in ("PT5_percent", "OT5_percent", "ALV_m_s", "AAV_rad_s", "AAS", "final_position_error_m"):
        assert set(found[name]) == {"mean", "median", "p95"}
    assert found["wall_s"] > 0.0
    assert found["steps_per_s"] > 0.0


def test_the_same_evaluation_twice_gives_the_same_figures(fulmar):
    first, second = (json.loads(fulmar(*EVALUATE, "--episodes", "2", "--json")[1]) for _ in range(2))
    timing = {"wall_s", "steps_per_s"}
    assert {k: v for k, v in first.items() if k not in timing} == {
        k: v for k, v in second.items() if k not in timing
    }


def test_an_evaluation_for_people_is_a_table_with_a_result(fulmar):
    code, out, _ = fulmar(*EVALUATE, "--episodes", "2")
    assert code == 0
    assert "success 1.000 of 2 episodes" in out
    assert "PT5_percent" in out


def test_a_passport_is_shown_as_it_is(fulmar):
    code, out, err = fulmar("bundle", "show", SHIPPED, "--json")
    assert (code, err) == (0, "")
    assert json.loads(out) == json.loads((Path(SHIPPED) / "passport.json").read_text())
    reported = fulmar("bundle", "show", SHIPPED)[1]
    assert "control_hz" in reported
    assert re.search(r"trained: success +0\.\d{3} to \d\.\d{3} in \d+ checks", reported)
    assert "{" not in reported


def test_the_shipped_bundle_is_accepted(fulmar):
    code, out, err = fulmar("bundle", "check", SHIPPED, "--json")
    assert (code, err) == (0, "")
    assert json.loads(out)["accepted"] is True


def test_limits_of_a_run_reach_its_plan(fulmar, monkeypatch, tmp_path):
    class PlannedError(Exception):
        """Nothing is started."""

    def run(request):
        guards.append(request.guards)
        raise PlannedError

    guards = []
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(run_outcome, "run_and_evaluate", run)
    with pytest.raises(PlannedError):
        fulmar(*RUN, "--area=-2,2,-1,1", "--max-run-time", "60")
    assert (guards[0].area, guards[0].max_run_time_s) == ((-2.0, 2.0, -1.0, 1.0), 60.0)
