"""New robots without a gains file at the command line: what is printed, what a bag carries, how often they succeed."""

from __future__ import annotations

import json

import pytest

from fulmar_bringup.bag_origin import attachments
from fulmar_bringup.run_plan import RunPlan
from fulmar_core.config.paths import OWN_FOLDERS
from fulmar_core.config.strict_yaml import load_config
from fulmar_core.controllers.classical import gains_of
from fulmar_core.controllers.lqr import LqrWeights
from fulmar_core.robots.robot_file import load_robot
from fulmar_evaluation import run_outcome
from fulmar_ros.recorder_settings import RecorderSettings
from tests.new_robots import TASKS, write_new_robots

HEAVY = ("heavy_platform", "go_to_pose")


@pytest.fixture(autouse=True)
def own(tmp_path, monkeypatch):
    """The new robots are known, and the working folder is empty."""
    write_new_robots(tmp_path / "mine")
    monkeypatch.setenv(OWN_FOLDERS, str(tmp_path / "mine"))
    monkeypatch.chdir(tmp_path)


@pytest.mark.slow
@pytest.mark.timeout(600)
@pytest.mark.parametrize(("robot", "task"), TASKS.items())
def test_a_new_robot_succeeds_in_mujoco_without_a_gains_file(fulmar, robot, task):
    asked = ("--controller", "classical", "--through", "mujoco", "--episodes", "256", "--json")
    code, out, _ = fulmar("evaluate", robot, task, *asked)
    assert code == 0
    assert json.loads(out)["success_rate"] >= 0.95


def test_an_evaluation_says_once_that_default_gains_are_used(fulmar):
    asked = ("--through", "batch", "--episodes", "1", "--episode-s", "5")
    code, _, err = fulmar("evaluate", *HEAVY, "--controller", "lqr", *asked)
    assert code == 0
    (line,) = (line for line in err.splitlines() if "gains" in line)
    assert line == (
        "info: no gains file: default gains of 'lqr', computed from the limits of 'heavy_platform'. "
        "controllers/heavy_platform_lqr.yaml would take their place."
    )
    code, _, err = fulmar("evaluate", "floating_platform", "go_to_pose", "--controller", "lqr", *asked)
    assert (code, "gains" in err) == (0, False)


@pytest.mark.parametrize(
    ("words", "lines"),
    [
        (["--controller", "classical"], 1),
        (["--controller", "classical", "--fallback", "lqr"], 1),
        (["--controller", "excite", "--fallback", "lqr"], 1),
        (["--controller", "excite"], 0),
    ],
)
def test_a_run_says_once_that_default_gains_are_used(fulmar, capsys, monkeypatch, words, lines):
    class PlannedError(Exception):
        """Nothing is started."""

    def run(_request):
        raise PlannedError

    monkeypatch.setattr(run_outcome, "run_and_evaluate", run)
    with pytest.raises(PlannedError):
        fulmar("run", HEAVY[0], "--task", HEAVY[1], *words)
    assert capsys.readouterr().err.count("info: no gains file") == lines


def test_a_bag_carries_default_gains_as_a_file_that_can_be_used(tmp_path):
    plan = RunPlan(*HEAVY, "classical", "mujoco", 5.0)
    file = tmp_path / "heavy_platform_lqr.yaml"
    file.write_bytes(RecorderSettings(attachments=attachments(plan)).files()["controller.yaml"])
    assert load_config(LqrWeights, file) == gains_of(load_robot(HEAVY[0]))
