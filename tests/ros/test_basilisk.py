"""Basilisk behind the nodes that drive every robot, from the command line to the bag."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from fulmar_bags.contents import open_bag
from fulmar_bags.decode import odometries
from fulmar_core.robots.basilisk_robots import check_basilisk
from fulmar_core.robots.robot_file import load_robot
from tests.conftest import RosDomain
from tests.ros.cli import fulmar, json_of

pytestmark = [pytest.mark.slow, pytest.mark.timeout(240)]
ASKED = {
    "spacecraft_16": ("--task", "go_to_pose_3d", "--scenario", "valve_stuck_closed", "--duration", "12"),
    "cubesat_wheels": ("--goal", "0,0,20", "--duration", "12"),
}


def basilisk_processes() -> set[str]:
    """Numbers of the processes with Basilisk that this user runs."""
    found = set()
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            if (
                b"basilisk_server.py" in (folder / "cmdline").read_bytes()
                and folder.stat().st_uid == os.getuid()
            ):
                found.add(folder.name)
        except OSError:
            continue
    return found


@pytest.mark.parametrize("robot", sorted(ASKED))
def test_a_seed_repeats_a_run_in_lock_step_and_its_bag_can_be_rerun(
    robot: str, ros_domain: RosDomain, tmp_path: Path
) -> None:
    check_basilisk(load_robot(robot))
    asked = (robot, "--backend", "basilisk", *ASKED[robot], "--lockstep", "--seed", "3")
    before, paths = basilisk_processes(), []
    for bag in ("bag", "again"):
        done = fulmar("run", *asked, "--record", bag, "--json", env=ros_domain.env, cwd=tmp_path)
        summary = json_of(done.stdout)
        assert summary["failure"] is None, done.stderr
        assert summary["backend"] == "basilisk"
        paths.append(odometries(open_bag(tmp_path / bag).odometry()).pose)
    assert len(paths[0]) >= 50
    assert np.array_equal(*paths)
    assert np.ptp(paths[0], axis=0).max() > 1e-3
    rerun = fulmar("bag", "rerun", "bag", env=ros_domain.env, cwd=tmp_path)
    assert rerun.returncode == 0, rerun.stderr
    assert rerun.stdout.rstrip().endswith("same")
    assert basilisk_processes() <= before


def test_a_robot_on_the_water_is_one_line(ros_domain: RosDomain, tmp_path: Path) -> None:
    done = fulmar("run", "kingfisher", "--backend", "basilisk", env=ros_domain.env, cwd=tmp_path)
    assert done.returncode == 2
    assert done.stderr.splitlines() == [
        "fulmar: Basilisk simulates spacecraft and satellites only, and 'kingfisher' is none. MuJoCo simulates it."
    ]
