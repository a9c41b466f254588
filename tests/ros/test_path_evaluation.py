"""A path that is evaluated through the nodes: the goal node states what a loop without ROS is reported."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.conftest import RosDomain
from tests.ros.cli import fulmar


@pytest.mark.slow
def test_a_path_through_ros_gives_the_figures_of_mujoco(ros_domain: RosDomain, tmp_path: Path) -> None:
    words = (
        "benchmark drift --rows circle --controllers lqr --episodes 2 --no-report --json --jobs 1 --through"
    )
    found = {}
    for way in ("mujoco", "ros"):
        done = fulmar(*words.split(), way, "--out", str(tmp_path), env=ros_domain.env, cwd=tmp_path)
        assert done.returncode == 0, done.stderr
        found[way] = json.loads(done.stdout)["rows"]["circle"]["controllers"]["lqr"]["figures"]
    assert found["ros"]["velocity_error"]["mean"] < 0.05
    for name, figure in found["mujoco"].items():
        for statistic, value in figure.items():
            assert abs(found["ros"][name][statistic] - value) < 1e-5, (name, statistic)
