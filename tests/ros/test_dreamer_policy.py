"""A policy of DreamerV3 in the node that runs every policy, in lock step, and from its bag again."""

from __future__ import annotations

from pathlib import Path

import pytest

from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks import load_task
from tests.conftest import RosDomain
from tests.ros.cli import fulmar
from tests.ros.test_runs import command_bytes
from tests.training.dreamer_runs import drawn_network, write_run
from training.export import export

ROBOT, TASK = load_robot("turtlebot2"), load_task("go_to_position")


@pytest.mark.slow
def test_the_node_carries_its_memory_and_a_rerun_gives_the_same_commands(
    ros_domain: RosDomain, tmp_path: Path
) -> None:
    export(write_run(tmp_path / "learned", drawn_network(ROBOT, TASK), ROBOT, TASK), tmp_path / "bundle")
    asked = ("turtlebot2", "--task", "go_to_position", "--controller", "policy", "--policy", "bundle")
    record = ("--lockstep", "--seed", "3", "--duration", "4", "--record", "bag")
    done = fulmar("run", *asked, *record, env=ros_domain.env, cwd=tmp_path)
    assert done.returncode in (0, 1), done.stderr  # its weights are drawn: it need not meet the goal
    assert len(set(command_bytes(tmp_path / "bag"))) > 20, "it does something, differently each time"
    done = fulmar("bag", "rerun", "bag", env=ros_domain.env, cwd=tmp_path)
    assert "the same, largest difference 0" in done.stdout, done.stdout + done.stderr
