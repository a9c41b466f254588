"""A plan whose policy sees starts the simulated camera; where none runs, it is refused in one line."""

from __future__ import annotations

from dataclasses import replace

import pytest

from fulmar_bringup.completion import completed
from fulmar_bringup.run_plan import RunPlan
from fulmar_core.config.errors import ConfigError
from fulmar_core.loop.policy_bundle import write_bundle
from fulmar_evaluation.evaluation import Trial, runs_of
from tests.policy_server.test_seeing_policy import nearest_network, passport


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
