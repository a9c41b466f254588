"""`fulmar parity`: one command, one document, one page."""

from __future__ import annotations

import json
import math

import pytest

from fulmar_core.config import other_environment
from fulmar_core.robots.basilisk_robots import check_basilisk
from fulmar_core.robots.robot_file import load_robot
from fulmar_evaluation.parity.page import lines_of, page_of
from fulmar_evaluation.parity.parity import ParityRequest, parity
from fulmar_evaluation.parity.simulators import missing_of, simulators_of
from tests.fulmar_cli.command_line import complaint

pytest.importorskip("mujoco")


def request(robot, **changes):
    usual = {"task": None, "controller": "classical", "policy": None, "scenario": "nominal", "runs": 1}
    return ParityRequest(robot, **{**usual, "duration_s": 0.4, "episodes": 0, "seed": 0, **changes})


@pytest.fixture(scope="module")
def document():
    return parity(request("floating_platform"), lambda line: None)


def test_mujoco_and_the_mock_move_a_platform_as_the_core_does(document):
    assert set(document["divergence"]) == {"mock", "mujoco"}
    for apart in document["divergence"].values():
        assert apart["lost_runs"] == 0
        assert apart["position_m"]["largest"] < 1e-6
        assert apart["position_m"]["seen_after_s"] is None
        assert [row["time_s"] for row in apart["position_m"]["at"]] == pytest.approx([0.2, 0.4])
    assert document["noise"]["position_m"] == 0.001
    assert "aircraft only" in document["skipped"]["jsbsim"]
    assert "spacecraft and satellites only" in document["skipped"]["basilisk"]


def test_the_page_has_every_simulator_its_divergence_and_the_noise(document):
    page = page_of(document)
    for text in ("### mock", "### mujoco", "| noise of one reading | 0.001 |", "jsbsim: flies aircraft only"):
        assert text in page
    assert any(line.startswith("mujoco, after 0.4 s: position [m]") for line in lines_of(document))


def test_what_a_sensor_sees_is_named_with_its_time_and_success_with_its_interval(document):
    apart = json.loads(json.dumps(document["divergence"]["mujoco"]))
    apart["position_m"]["seen_after_s"] = 0.4
    success = {
        "core": {"success_rate": 1.0, "low": 0.9, "high": 1.0},
        "mujoco": {"problem": "it takes images"},
    }
    other = {**document, "divergence": {"mujoco": apart}, "success": success, "episodes": 64}
    assert "| beyond that after [s] | 0.4 | never |" in page_of(other)
    assert "| core | 1.000 | 0.900 | 1.000 |" in page_of(other)
    assert "mujoco: it takes images" in lines_of(other)


def test_the_command_writes_page_and_json(fulmar, tmp_path):
    words = ("--runs", 1, "--duration", 0.2, "--episodes", 0, "--controller", "classical")
    code, printed, _ = fulmar("parity", "floating_platform", *words, "--out", tmp_path / "page", "--json")
    assert code == 0
    assert json.loads((tmp_path / "page" / "parity.json").read_text()) == json.loads(printed)
    assert (tmp_path / "page" / "parity.md").read_text().startswith("# floating_platform in every simulator")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("floating_platfrom",), "floating_platform"),
        (("floating_platform", "--task", "fly_hold"), "fly_hold"),
        (("floating_platform", "--duration", "-1"), "--duration -1"),
        (("floating_platform", "--controller", "lqi"), "lqi"),
    ],
)
def test_a_mistake_gets_one_line(fulmar, words, said):
    assert said in complaint(fulmar("parity", *words))


def test_a_missing_basilisk_is_named_with_what_to_run(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(other_environment, "config_directory", lambda: tmp_path / "configs")
    spacecraft = load_robot("spacecraft_16")
    assert "basilisk" not in simulators_of(spacecraft)
    assert missing_of(spacecraft)["basilisk"].endswith("is missing. Run: make peers")


@pytest.mark.slow
@pytest.mark.parametrize(("robot", "position_m"), [("spacecraft_16", 5e-3), ("cubesat_wheels", 0.0)])
def test_a_spacecraft_and_a_satellite_move_in_basilisk_too(robot, position_m):
    check_basilisk(load_robot(robot))
    document = parity(request(robot, duration_s=60.0), lambda line: None)
    apart = document["divergence"]["basilisk"]
    assert apart["lost_runs"] == 0
    assert apart["position_m"]["largest"] <= position_m
    assert apart["turn_rate_deg_s"]["largest"] < math.degrees(1e-6)


@pytest.mark.slow
def test_success_is_counted_in_each_simulator():
    found = parity(request("floating_platform", episodes=4), lambda line: None)["success"]
    assert set(found) == {"core", "mock", "mujoco"}
    assert all(each["low"] <= each["success_rate"] <= each["high"] for each in found.values())


@pytest.mark.slow
def test_an_aircraft_flies_in_jsbsim_too():
    pytest.importorskip("jsbsim")
    asked = request("airship_v7", task="fly_hold", controller="lqi", duration_s=2.0)
    document = parity(asked, lambda line: None)
    apart = document["divergence"].get("jsbsim")
    if apart is None:
        pytest.skip(document["skipped"]["jsbsim"])
    assert 0.0 < apart["position_m"]["largest"] < 0.5
