"""Runs beside a thing in space: keep-out volumes that were entered, drifts into them, and what the camera saw."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from fulmar_bags.run_record import read_run
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks import load_task
from fulmar_core.worlds.structures import load_structure
from fulmar_evaluation.coverage.coverage import coverage
from fulmar_evaluation.coverage.of_runs import with_coverage
from fulmar_evaluation.report.run_view import result_of, views
from fulmar_evaluation.run_summary import summarise, summary_text
from tests.synthetic_space_run import SpacePlan, write_space_run

AHEAD = (0.0, 0.0, 0.0)  # roll, pitch, yaw [deg]


@pytest.fixture(scope="module")
def entered(tmp_path_factory: pytest.TempPathFactory):
    """The record of a run whose goal lay in the Gateway."""
    plan = SpacePlan(
        thing="gateway", start=(3.0, 0.0, 0.0, *AHEAD), goal=(1.0, 0.0, 0.0, *AHEAD), duration_s=30.0
    )
    return read_run(write_space_run(tmp_path_factory.mktemp("runs") / "entered", plan))


def test_a_run_that_entered_a_keep_out_volume_has_failed_and_says_so(entered) -> None:
    summary = summarise(entered)
    assert summary["success"] is False and summary["collided"] is True
    assert summary["touched"] == "the keep-out volume of 'gateway'"
    assert summary["least_distance_m"] == pytest.approx(
        1.0 - load_structure("gateway").keep_out.radius, abs=0.05
    )
    assert "entered the keep-out volume of 'gateway'" in summary_text(summary)


def test_the_report_of_a_run_that_entered_a_keep_out_volume_names_it(entered) -> None:
    word, sentence = result_of(views([entered])[0])
    assert word == "Missed" and "It entered the keep-out volume of 'gateway'." in sentence


def test_a_run_that_ends_in_motion_says_when_its_drift_enters_the_volume(tmp_path: Path) -> None:
    plan = SpacePlan(
        thing="gateway", start=(4.0, 0.0, 0.0, *AHEAD), goal=(2.0, 0.0, 0.0, *AHEAD), duration_s=6.0
    )
    record = read_run(write_space_run(tmp_path / "adrift", plan))
    summary, last = summarise(record), record.motion.states
    way = last.position_in_world[-1, 0] - load_structure("gateway").keep_out.radius
    assert summary["drift_enters_s"] == pytest.approx(way / -last.velocity_in_world[-1, 0], abs=0.5)
    assert summary["collided"] is False
    assert f"it enters that volume after {summary['drift_enters_s']:.0f} s" in summary_text(summary)


def test_a_run_without_a_thing_has_none_of_these_figures(tmp_path: Path) -> None:
    summary = summarise(read_run(write_space_run(tmp_path / "alone", SpacePlan(duration_s=5.0))))
    assert summary["drift_enters_s"] is None and summary["coverage"] is None and summary["touched"] is None


def test_episodes_of_an_inspection_have_the_coverage_of_their_poses_up_to_a_limit() -> None:
    robot, task = load_robot("cubesat_8"), load_task("inspect")
    pose = np.array((-2.5, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0))  # x ahead, on the thing's middle
    names = ("x", "y", "z", "qx", "qy", "qz", "qw")
    columns = {name: np.full((2, 30), number) for name, number in zip(names, pose, strict=True)}
    run = SimpleNamespace(**columns, control_dt=0.1)
    figures = {"coverage": np.full(2, np.nan), "effort": np.zeros(2)}
    found = with_coverage(figures, run, robot, task, most=1)
    exact = coverage(task.structures[0], pose[None], robot.sensors.camera)
    assert found["coverage"][0] == exact.share > 0.02
    assert found["coverage_possible"][0] == exact.visible >= exact.share
    assert np.isnan(found["coverage"][1]) and found["effort"] is figures["effort"]
    assert with_coverage({}, run, robot, task) == {}
