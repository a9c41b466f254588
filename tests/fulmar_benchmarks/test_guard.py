"""The benchmark of the envelope guard: defective controllers leave without it, and stay with it."""

from __future__ import annotations

import numpy as np
import pytest

from fulmar_benchmarks.campaign import run
from fulmar_benchmarks.catalogue import choice
from fulmar_benchmarks.guard.campaign import GuardRuns
from fulmar_benchmarks.guard.defects import DEFECTS
from fulmar_benchmarks.guard.moving_trial import Field, decision_of, drive
from fulmar_benchmarks.guard.trial import MUJOCO, Trial, decision_ms, fly
from fulmar_core.config.errors import ConfigError, UnknownNameError


def asked(tmp_path, **given):
    small = {"robots": "floating_platform", "runs": 3, "controller": "lqr", "jobs": 1, "out": tmp_path}
    return GuardRuns(choice("guard", **{**small, **given}))


def test_an_adversary_leaves_without_the_guard_and_stays_with_it_and_both_are_in_the_table(tmp_path):
    result = run(asked(tmp_path, parts="defects", defects="adversary"))
    on, off = result.document["robots"][0]["trials"]
    assert (on["guarded"], on["left"], off["guarded"], off["left"]) == (True, 0, False, 3)
    assert on["worst_m"] < 0.0 < off["worst_m"] and on["trip_share"] == 1.0
    assert [check.met for check in result.benchmark.checks(result.document)] == [True, True]
    assert len(result.benchmark.tables(result.document)[0].rows) == 2


@pytest.mark.parametrize("defect", DEFECTS)
def test_every_defect_acts_in_the_plane(defect):
    found = fly(
        Trial("floating_platform", defect, guarded=True, runs=2, seed=1, controller="lqr", seconds=3.0)
    )
    assert found["runs"] == 2 and found["left"] == 0


def test_a_run_that_left_its_area_is_no_success_wherever_it_ends(monkeypatch):
    sound = Trial("floating_platform", "none", False, 2, 1, controller="lqr", seconds=25.0)
    inside = fly(sound)
    assert (inside["left"], inside["success"]) == (0, 1.0)
    monkeypatch.setattr("fulmar_benchmarks.guard.trial.SIDE_M", 0.9 * (2.5 + inside["worst_m"]))
    beyond = fly(sound)
    assert beyond["left"] >= 1 and beyond["success"] == 1.0 - beyond["left"] / 2


def test_a_drive_that_left_its_area_is_no_success_wherever_it_ends(monkeypatch):
    sound = Trial("turtlebot2", "none", False, 2, 1, controller="classical", seconds=25.0)
    assert drive(sound)["success"] == 1.0
    monkeypatch.setattr(Field, "beyond", lambda self, truth: np.array([0.1, -0.1]))
    assert drive(sound)["success"] == 0.5


def test_mujoco_flies_the_same_trial():
    found = fly(
        Trial("floating_platform", "adversary", True, 1, 1, way=MUJOCO, controller="lqr", seconds=8.0)
    )
    assert found["left"] == 0 and found["trip_share"] == 1.0


def test_a_decision_is_timed():
    found = decision_ms("spacecraft_16", "lqr", 1, count=20)
    assert 0.0 < found["p50"] <= found["p99"]


@pytest.mark.parametrize("robot", ["kingfisher", "turtlebot2"])
@pytest.mark.parametrize("defect", DEFECTS)
def test_every_defect_acts_on_boats_and_wheels(robot, defect):
    found = drive(Trial(robot, defect, True, 2, 1, controller="classical", seconds=2.0))
    assert found["runs"] == 2 and found["left"] == 0


@pytest.mark.slow
@pytest.mark.parametrize("defect", DEFECTS)
def test_every_defect_acts_on_wings_which_stay_above_the_water(defect):
    found = drive(Trial("airship_v7", defect, True, 2, 1, seconds=2.0))
    assert found["runs"] == 2 and found["left"] == 0 and found["worst_m"] < 0.0


def test_a_trial_says_how_long_its_runs_are(tmp_path):
    trials = asked(
        tmp_path, robots=["kingfisher", "airship_v7"], parts=["defects"], defects=["drift"]
    ).cells()
    assert [each.trial.seconds for each in trials] == [60.0, 60.0, 20.0, 20.0]


def test_an_adversary_leaves_on_wheels_without_the_guard_and_stays_with_it(tmp_path):
    result = run(
        asked(tmp_path, robots="turtlebot2", controller="classical", parts="defects", defects="adversary")
    )
    on, off = result.document["robots"][0]["trials"]
    assert (on["left"], off["left"]) == (0, 3) and on["trip_share"] == 1.0
    parts = asked(tmp_path, robots="turtlebot2", controller="classical").cells()
    assert not [cell for cell in parts if "mujoco" in cell.name], "these are of robots that float"


def test_a_decision_by_rollouts_is_timed_beside_its_period():
    found = decision_of("turtlebot2", "classical", 1, count=20)
    assert 0.0 < found["p50"] <= found["p99"] and found["period"] == pytest.approx(100.0)


@pytest.mark.parametrize(
    ("robot", "controller", "period"), [("airship_v7", "policy", 40.0), ("floating_platform", "lqr", 200.0)]
)
def test_what_a_decision_takes_of_the_period_is_of_the_rate_of_its_controller(
    tmp_path, robot, controller, period
):
    asked_for = asked(tmp_path, robots=[robot], parts=["decision"], controller=controller)
    result = run(asked_for)
    (one,) = result.document["robots"]
    took, checks = one["decision_ms"], {check.name: check for check in asked_for.checks(result.document)}
    assert took["period"] == period
    share = checks[f"{robot}: 99th percentile of a decision, of the period"].measured
    assert share == pytest.approx(took["p99"] / period, rel=1e-3)


def test_robots_without_such_a_guard_and_parts_that_do_not_exist_are_refused(tmp_path):
    with pytest.raises(ConfigError, match="guard 'envelope' is for robots that float"):
        run(asked(tmp_path, robots="cubesat_wheels"))
    with pytest.raises(UnknownNameError):
        asked(tmp_path, parts="defect")
