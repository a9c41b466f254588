"""A controller that is a node of the user's own, outside of Fulmar: in runs and behind the adapter."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from fulmar_core.config.errors import FAILED
from tests.conftest import RosDomain
from tests.ros.cli import fulmar, json_of, run_in_real_time

PAGE = Path(__file__).resolve().parents[2] / "docs" / "external-controller.md"
ASKED = ("turtlebot2", "--task", "go_to_position", "--controller", "external")
STAMP = "        command.header.stamp = message.header.stamp  # of the odometry that it answers\n"


@contextmanager
def node(folder: Path, env: dict[str, str], *changes: tuple[str, str]) -> Iterator[None]:
    """The node of the page, with some words replaced, in a process of its own while the context lasts."""
    code = re.search(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    assert code is not None
    text = code.group(1)
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    (folder / "steer.py").write_text(text)
    process = subprocess.Popen(
        [sys.executable, "steer.py"],
        cwd=folder,
        env=env,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        yield
    finally:
        process.terminate()
        process.wait()


@pytest.mark.slow
def test_the_node_of_the_page_reaches_its_goal_in_lock_step(ros_domain: RosDomain, tmp_path: Path) -> None:
    with node(tmp_path, ros_domain.env):
        asked = ("run", *ASKED, "--lockstep", "--duration", "12", "--record", "bag", "--json")
        done = fulmar(*asked, env=ros_domain.env, cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    summary = json_of(done.stdout)
    assert (summary["success"], summary["steps"], summary["watchdog_trips"]) == (True, 120, 0)
    assert summary["latency_ms"]["p50"] is not None
    assert summary["inference_ms"]["p50"] is None


@pytest.mark.slow
@pytest.mark.real_time
def test_a_node_of_another_stack_drives_the_simulated_robot_through_the_adapter(
    ros_domain: RosDomain, tmp_path: Path
) -> None:
    """Plain Twist on a topic of its own: its commands carry no stamp."""
    changes = (
        ("import PointStamped, TwistStamped", "import PointStamped, Twist"),
        ('(TwistStamped, "cmd_vel"', '(Twist, "/velocity_smoother/input"'),
        ("TwistStamped()", "Twist()"),
        ("command.twist.", "command."),
        (STAMP, ""),
    )
    adapter = ("--adapter", "turtlebot2_kobuki_node", "--topic", "/velocity_smoother/input")
    more = ("--duration", "12", "--rate", "2", "--control-hz", "50")
    with node(tmp_path, ros_domain.env, *changes):
        done = run_in_real_time(*ASKED, *adapter, *more, env=ros_domain.env, cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    summary = json_of(done.stdout)
    assert summary["success"]
    assert summary["steps"] > 300
    assert summary["latency_ms"]["p50"] is None
    done = fulmar(
        "bag", "rerun", "bag", "--controller", "classical", "--from", "odometry", "--json",
        env=ros_domain.env, cwd=tmp_path,
    )  # fmt: skip
    compared = json_of(done.stdout)
    assert compared["steps"] == pytest.approx(
        600, abs=5
    )  # one a control period, though no command has a stamp
    assert compared["compared"]


@pytest.mark.slow
def test_without_a_publisher_that_fits_a_run_fails_in_one_line(ros_domain: RosDomain, tmp_path: Path) -> None:
    changes = (
        ("import PointStamped, TwistStamped", "import PointStamped, Twist"),
        ("(TwistStamped,", "(Twist,"),
        ("TwistStamped()", "Twist()"),
    )
    with node(tmp_path, ros_domain.env, *changes):
        done = fulmar("run", *ASKED, "--record", "bag", "--json", env=ros_domain.env, cwd=tmp_path)
    assert done.returncode == FAILED
    failure = json_of(done.stdout)["failure"]
    assert failure.startswith("no publisher on /turtlebot2/cmd_vel within 20 s. /turtlebot2/steer publishes")
    assert f"Start your controller, in ROS domain {ros_domain.id}" in failure
