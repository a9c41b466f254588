"""A run that is driven to identify the robot by, over ROS, and what its bag states."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.conftest import RosDomain
from tests.ros.cli import fulmar, json_of


@pytest.mark.slow
def test_an_excited_run_succeeds_without_a_goal_and_its_bag_states_thrust_and_inertia(
    ros_domain: RosDomain, tmp_path: Path
) -> None:
    asked = ("floating_platform", "--controller", "excite", "--lockstep", "--duration", "60", "--seed", "4")
    done = fulmar("run", *asked, "--record", "bag", "--json", env=ros_domain.env, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    reported = fulmar(
        "identify", "bag", "--known", "mass=5.32+-0.005", "--json", env=ros_domain.env, cwd=tmp_path
    )
    assert reported.returncode == 0, reported.stderr
    estimates = json_of(reported.stdout)["estimates"]
    assert estimates["thrust"]["value"] == pytest.approx(1.0, rel=0.03)
    assert estimates["yaw_inertia"]["value"] == pytest.approx(0.2045, rel=0.03)


@pytest.mark.slow
def test_a_calibrated_run_says_so_in_its_bag_and_needs_a_file_for_its_own_robot(
    ros_domain: RosDomain, tmp_path: Path
) -> None:
    from fulmar_bags.run_record import read_run

    (tmp_path / "c.yaml").write_text("robot: floating_platform\nmass: {value: 6.0, low: 5.9, high: 6.1}\n")
    asked = (
        "--controller",
        "lqr",
        "--lockstep",
        "--duration",
        "2",
        "--calibration",
        "c.yaml",
        "--record",
        "bag",
    )
    done = fulmar("run", "floating_platform", *asked, "--json", env=ros_domain.env, cwd=tmp_path)
    assert "run failed" not in done.stderr
    assert read_run(tmp_path / "bag").info["calibration"] == str(tmp_path / "c.yaml")
    wrong = fulmar("run", "modular_freeflyer", "--calibration", "c.yaml", env=ros_domain.env, cwd=tmp_path)
    assert wrong.returncode == 2
    assert "is for 'floating_platform', not for 'modular_freeflyer'" in wrong.stderr
