"""A run with all of the user's own: sensor, estimator, and a controller with an observer that reads the supply."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader

from fulmar_bags.contents import open_bag
from fulmar_bags.run_record import read_run
from fulmar_core.config.paths import OWN_FOLDERS
from fulmar_core.robots.robot_file import load_robot
from tests.conftest import RosDomain
from tests.own_files import blocks, own_folder, write_sentry
from tests.ros.cli import fulmar as in_a_process
from tests.ros.cli import json_of
from tests.ros.test_believed import shifted_by

CONTROL = """
from dataclasses import replace
import numpy as np

class Shifted:
    def reset(self): pass
    def update(self, measured, previous): return replace(measured, x=measured.x + 1.0)

class All:
    readings = ("supply", "front")
    def __init__(self, robot, task, settings): self.observer = Shifted()
    def reset(self): pass
    def act(self, inputs):
        assert inputs.readings.keys() <= {"supply", "front"}
        command = np.zeros_like(inputs.previous)
        command[:, 0] = inputs.readings["supply"][:, 0] > 1e5 if len(inputs.readings) == 2 else 0.0
        return command
"""
OWN = ("--controller", "by_hand:All")


def test_a_run_has_them_in_its_bag_and_gives_the_same_answers_again(
    ros_domain: RosDomain, fulmar, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folders = write_sentry(tmp_path, "floating_platform")
    (estimator,) = blocks("own-estimator.md", "python")
    (tmp_path / "my_estimate.py").write_text(estimator)
    (tmp_path / "by_hand.py").write_text(CONTROL)
    asked = ("run", "sentry", "--task", "go_to_pose", "--lockstep", "--scenario", "tank_low", "--json")
    start = ("--start", "0,0,0", "--duration", "5")  # it looks at the wall
    own = (*OWN, *start, "--estimator", "my_estimate:MeanPose", "--record", "bag")
    done = in_a_process(*asked, *own, env=ros_domain.env | {OWN_FOLDERS: folders}, cwd=tmp_path)
    assert json_of(done.stdout)["failure"] is None, done.stderr

    with next((tmp_path / "bag").glob("*.mcap")).open("rb") as stream:
        files = {file.name: file.data.decode() for file in make_reader(stream).iter_attachments()}
    assert files["estimator.py"] == estimator
    assert files["sensor_front.py"] == (tmp_path / "my_sensor.py").read_text()
    np.testing.assert_allclose(shifted_by(tmp_path / "bag"), 1.0, atol=1e-9)
    assert "/sentry/range/front" in {topic.name for topic in open_bag(tmp_path / "bag").topics.values()}

    monkeypatch.setenv(OWN_FOLDERS, folders)
    with own_folder(tmp_path, monkeypatch):
        record, tank = read_run(tmp_path / "bag"), load_robot("floating_platform").actuators.tank
        assert record.supply.pascal[0] == pytest.approx(0.03 * tank.pressure, rel=0.5)
        assert record.supply.pascal[-1] < record.supply.pascal[0]
        assert record.applied.effort[:, 0].any()
        code, out, err = fulmar("bag", "rerun", "bag", *OWN, "--from", "odometry")
        assert code == 0, out + err
        code, _, err = fulmar("report", "bag", "--out", "report.html")
        assert code == 0, err
        assert "Pressure of the supply" in (tmp_path / "report.html").read_text()
