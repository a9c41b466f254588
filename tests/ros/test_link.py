"""A radio link between plant and controller: late and lost messages, in lock step and by the clock."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fulmar_bags.contents import open_bag
from fulmar_bags.decode import odometries
from tests.conftest import RosDomain
from tests.ros.cli import fulmar, json_of
from tests.ros.test_runs import command_bytes

ASKED = (
    "floating_platform",
    "--task",
    "go_to_pose",
    "--start",
    "1,0.5,60",
    "--goal",
    "0,0,0",
    "--scenario",
    "radio",
)


def run(folder: Path, domain: RosDomain, name: str, *more: str) -> dict[str, object]:
    done = fulmar("run", *ASKED, *more, "--record", name, "--json", env=domain.env, cwd=folder)
    assert done.stdout.startswith("{"), done.stderr
    return json_of(done.stdout)


@pytest.mark.slow  # tests/fulmar_core/worlds/test_link.py: a seed gives the same link
def test_a_lock_stepped_run_over_a_radio_is_the_same_twice_and_again_from_its_bag(
    ros_domain: RosDomain, tmp_path: Path
) -> None:
    asked = ("--controller", "lqr", "--lockstep", "--seed", "5", "--duration", "12")
    one, two = (run(tmp_path, ros_domain, name, *asked) for name in ("one", "two"))
    assert one["failure"] is None
    assert one["success"] is two["success"] is True
    assert command_bytes(tmp_path / "one") == command_bytes(tmp_path / "two")
    # Of 600 odometries and of the commands that answer them, one in twenty is lost.
    stamps = odometries(open_bag(tmp_path / "one").odometry()).stamp_ns
    assert 540 < len(np.unique(stamps)) < 595
    again = fulmar("bag", "rerun", "one", "--json", env=ros_domain.env, cwd=tmp_path)
    assert again.returncode == 0, again.stdout
    assert json_of(again.stdout)["same"] is True


@pytest.mark.slow
@pytest.mark.real_time
def test_a_run_in_real_time_over_a_radio_arrives_and_its_bag_gives_the_same_actions(
    ros_domain: RosDomain, tmp_path: Path
) -> None:
    result = run(tmp_path, ros_domain, "live", "--controller", "lqr", "--rate", "2", "--duration", "14")
    assert result["failure"] is None or "no command for" in str(result["failure"])
    assert float(result["latency_ms"]["p50"]) > 60.0  # 160 ms of the robot's time, at twice its pace
    again = fulmar("bag", "rerun", "live", "--json", env=ros_domain.env, cwd=tmp_path)
    assert json_of(again.stdout)["same"] is True


PAIRS = [
    ("floating_platform", "go_to_pose", "lqr"),
    ("floating_platform", "go_to_pose", "policy"),
    ("kingfisher", "go_to_pose", "classical"),
    ("kingfisher", "go_to_pose", "policy"),
    ("spacecraft_16", "go_to_pose_3d", "lqr"),
    ("spacecraft_16", "go_to_pose_3d", "policy"),
]


@pytest.mark.slow
@pytest.mark.parametrize(("robot", "task", "controller"), PAIRS)
def test_no_robot_diverges_over_a_radio(
    robot: str, task: str, controller: str, ros_domain: RosDomain, tmp_path: Path
) -> None:
    asked = ("evaluate", robot, task, "--controller", controller, "--scenario", "radio", "--through", "ros")
    done = fulmar(*asked, "--episodes", "4", "--json", env=ros_domain.env, cwd=tmp_path, timeout_s=200.0)
    figures = json_of(done.stdout)
    assert figures["left_the_geofence"] == figures["collided"] == 0.0
    assert figures["final_position_error_m"] < 1.5
