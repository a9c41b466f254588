"""The pressure of the gas supply through a whole run: controller, bag, diagnostics, report and re-run."""

from __future__ import annotations

from pathlib import Path

import pytest

from fulmar_bags.run_record import read_run
from fulmar_core.robots.robot_file import load_robot
from tests.conftest import RosDomain
from tests.ros.cli import fulmar, json_of

# Opens one valve as long as the gauge says that there is gas, so that its answers show the readings that it had.
CONTROL = """
import numpy as np
class WhileThereIsGas:
    readings = ("supply",)
    def __init__(self, robot, task, settings): pass
    def reset(self): pass
    def act(self, inputs):
        command = np.zeros_like(inputs.previous)
        command[:, 0] = inputs.readings["supply"][:, 0] > 6.0e5 if "supply" in inputs.readings else 0.0
        return command
"""
OWN = ("--controller", "my_control:WhileThereIsGas")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("robot", "task"), [("floating_platform", "go_to_pose"), ("spacecraft_16", "go_to_pose_3d")]
)
def test_a_tank_that_empties_is_in_run_bag_diagnostics_report_and_rerun(
    robot: str, task: str, ros_domain: RosDomain, tmp_path: Path
) -> None:
    (tmp_path / "my_control.py").write_text(CONTROL)
    asked = (
        "run",
        robot,
        "--task",
        task,
        *OWN,
        "--scenario",
        "tank_low",
        "--lockstep",
        "--record",
        "bag",
        "--json",
    )
    done = fulmar(*asked, "--duration", "12", env=ros_domain.env, cwd=tmp_path)
    assert json_of(done.stdout)["failure"] is None, done.stderr

    record, tank = read_run(tmp_path / "bag"), load_robot(robot).actuators.tank
    assert record.supply.pascal[0] == pytest.approx(0.03 * tank.pressure, rel=0.5)
    assert record.supply.pascal[-1] < tank.regulated
    open_valve = record.applied.effort[:, 0] > 0.0
    assert open_valve.any()
    assert not open_valve[-1]  # its controller has seen that there is no gas
    newest = record.last_health("plant")
    assert newest is not None
    assert "is below the 8 bar of the regulator" in newest.message
    assert float(newest.values["supply_pressure_bar"]) < 8.0

    done = fulmar("report", "bag", "--out", "report.html", env=ros_domain.env, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "Pressure of the supply" in (tmp_path / "report.html").read_text()
    done = fulmar("bag", "plot", "bag", "--out", "plot.html", env=ros_domain.env, cwd=tmp_path)
    assert done.returncode == 0, done.stderr

    done = fulmar("bag", "rerun", "bag", *OWN, "--from", "odometry", env=ros_domain.env, cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
