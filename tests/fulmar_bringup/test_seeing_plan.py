"""A plan whose policy sees starts the simulated camera; where none runs, it is refused in one line."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from fulmar_bringup.completion import completed
from fulmar_bringup.run_plan import RunPlan
from fulmar_core.config.errors import ConfigError
from fulmar_core.loop.policy_bundle import write_bundle
from fulmar_evaluation.evaluation import Trial, evaluate_trial, runs_of
from fulmar_evaluation.trial_plan import plan_trial
from tests.policy_server.test_seeing_policy import nearest_network, passport

REFUSAL = r"takes images, and evaluations --through ros run no camera. Evaluate it with --through mujoco"
OWN = """
import numpy as np

class Sees:
    readings = ("camera_depth",)

    def __init__(self, robot, task, settings):
        pass

    def reset(self):
        pass

    def act(self, inputs):
        return np.zeros((1, 8))


class Blind(Sees):
    readings = ("imu",)
"""


@pytest.fixture
def plan(tmp_path):
    write_bundle(tmp_path / "bundle", *nearest_network(), passport())
    return RunPlan("cubesat_8", "dock", "policy", "mujoco", policy=str(tmp_path / "bundle"), seed=3)


def test_the_simulated_camera_runs_with_a_policy_that_sees(plan):
    assert completed(plan).extras == ("camera",)
    assert completed(replace(plan, extras=("camera",))).extras == ("camera",)


def test_no_camera_runs_with_a_law(plan):
    assert completed(replace(plan, controller="pd", policy="")).extras == ()


def test_an_evaluation_through_ros_refuses_a_policy_that_sees(plan):
    whole = replace(completed(plan), duration_s=1.0)
    with pytest.raises(
        ConfigError, match=r"takes images, and evaluations --through ros run no camera. Evaluate it with"
    ):
        next(runs_of(Trial(whole, "ros", 1)))


def through_ros(controller, policy=None):
    return plan_trial(
        robot="cubesat_8", task="dock", controller=controller, policy=policy, through="ros", episodes=1, seed=3,
        scenario="nominal", control_hz=None, jobs=1, episode_s=4.0, steps=None, worlds=None, bounds=None,
    )  # fmt: skip


@pytest.fixture
def flights(monkeypatch):
    """Plans that are flown through ros, which nothing does here."""
    flown = []
    monkeypatch.setattr(
        "fulmar_evaluation.ros_evaluation.roll_out_through_ros", lambda plan, **_: flown.append(plan)
    )
    return flown


def test_what_evaluate_plans_through_ros_is_refused_where_the_policy_sees(plan, flights):
    with pytest.raises(ConfigError, match=REFUSAL):
        evaluate_trial(through_ros("policy", Path(plan.policy)))
    assert flights == []


def test_a_controller_of_ones_own_is_refused_through_ros_by_its_readings(tmp_path, monkeypatch, flights):
    (tmp_path / "own_eyes.py").write_text(OWN)
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(ConfigError, match=f"'own_eyes:Sees' {REFUSAL}"):
        evaluate_trial(through_ros("own_eyes:Sees"))
    assert flights == []
    assert list(runs_of(through_ros("own_eyes:Blind"))) == [None]
    assert list(runs_of(through_ros("pd"))) == [None]
    assert [each.controller for each in flights] == ["own_eyes:Blind", "pd"]
