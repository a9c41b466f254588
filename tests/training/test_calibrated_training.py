"""A run that learns for one machine, as it was measured."""

from __future__ import annotations

from dataclasses import replace

import pytest

from fulmar_core.robots.calibration import Calibration, Measured, save_calibration
from fulmar_core.robots.robot_file import load_robot, use_calibration
from training import jobs
from training.jobs import Job, learn
from training.progress import progress_file


@pytest.fixture
def in_use(tmp_path, monkeypatch):
    """A platform with 0.8 N instead of 1 N, in use until the test ends."""
    monkeypatch.setenv("FULMAR_CALIBRATION", "")
    path = tmp_path / "measured.yaml"
    save_calibration(Calibration("floating_platform", thrust=Measured(0.8, 0.79, 0.81)), path)
    use_calibration(path, "floating_platform")
    return path


def test_it_learns_on_the_measured_robot_and_keeps_the_file(in_use, tmp_path, small_settings, monkeypatch):
    seen, train = [], jobs.train
    monkeypatch.setattr(
        jobs, "train", lambda robot, *rest, **more: (seen.append(robot), train(robot, *rest, **more))[1]
    )
    job = Job("one", "floating_platform", "go_to_pose", 1, small_settings, tmp_path / "run", updates=1)
    learn(job, progress_file(tmp_path / "progress.json"))
    assert seen[0].actuators.thrust == 0.8
    kept = tmp_path / "run" / "calibration.yaml"
    assert kept.read_bytes() == in_use.read_bytes()
    use_calibration(kept, "floating_platform")  # as a resumed run does
    learn(replace(job, updates=2), progress_file(tmp_path / "progress.json"))
    assert kept.read_bytes() == in_use.read_bytes()
    assert load_robot("floating_platform").actuators.thrust == 0.8
