"""A robot of one's own from nothing to a policy that drives it: four thrusters, the least that is controllable."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from tests.conftest import RosDomain
from tests.robot_files import new_platform
from tests.ros.cli import fulmar, json_of

LIMIT_S = 600.0


@pytest.mark.slow
@pytest.mark.timeout(LIMIT_S)
def test_from_nothing_to_a_running_policy_within_ten_minutes(ros_domain: RosDomain, tmp_path: Path) -> None:
    env = ros_domain.env | {"FULMAR_CONFIGS": str(tmp_path / "mine")}
    began = time.monotonic()

    def ask(*words: str) -> str:
        done = fulmar(*words, env=env, cwd=tmp_path, timeout_s=LIMIT_S)
        assert done.returncode == 0, done.stderr
        return done.stdout

    (tmp_path / "mine" / "robots").mkdir(parents=True)
    ask(*new_platform(4))
    ask("check", "robot", "with_4")
    ask("train", "with_4", "go_to_position", "--time-limit", "60", "--episodes", "32", "--out", "trained")
    ask("export", "trained", "--out", "bundle")
    task = ("with_4", "--task", "go_to_position", "--policy", "bundle")
    found = json_of(
        ask("run", *task, "--goal", "1,0.5", "--lockstep", "--duration", "40", "--record", "bag", "--json")
    )
    assert found["success"]
    assert time.monotonic() - began < LIMIT_S
