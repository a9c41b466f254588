"""A controller that draws, over the wires: its seed is that of the run, and its record has all that it needs."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.conftest import RosDomain
from tests.ros.cli import fulmar
from tests.ros.test_runs import command_bytes


@pytest.mark.slow
def test_a_run_with_the_same_seed_sends_the_same_commands_and_its_bag_runs_again(
    ros_domain: RosDomain, tmp_path: Path
) -> None:
    flights = {}
    for name, seed in (("first", "3"), ("again", "3"), ("other", "4")):
        asked = ("airship_v7", "--task", "fly_a", "--controller", "mppi", "--lockstep", "--seed", seed)
        record = ("--duration", "0.5", "--record", str(tmp_path / name))
        done = fulmar("run", *asked, *record, env=ros_domain.env, cwd=tmp_path)
        assert done.returncode == 1, done.stderr  # too short to hold anything
        flights[name] = command_bytes(tmp_path / name)
    assert len(flights["first"]) >= 50
    assert flights["first"] == flights["again"] != flights["other"]
    done = fulmar("bag", "rerun", str(tmp_path / "other"), env=ros_domain.env, cwd=tmp_path)
    assert "the same, largest difference 0" in done.stdout, done.stdout + done.stderr
