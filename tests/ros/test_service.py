"""The command of an installed service, run as it stands in the unit: after a start nothing moves by itself."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import psutil
import pytest

from fulmar_bringup.robot_operator import Operator
from fulmar_bringup.service.installation import UNITS
from fulmar_bringup.service.unit import command_of
from fulmar_core.config.errors import DONE
from fulmar_core.config.paths import config_path
from tests.conftest import RosDomain
from tests.ros.cli import fulmar
from tests.ros.neighbour import ROBOT, Neighbour, until

pytestmark = pytest.mark.real_time
STILL_S = 1.5  # in which a controller that had a goal would have opened valves many times
CLOSED_S = 1.0  # within which valves are closed after SIGTERM
# A node that publishes a goal once, latched, and stays.
LAPTOP = """
import time, rclpy
from geometry_msgs.msg import PoseStamped
from rclpy.qos import DurabilityPolicy, QoSProfile
from fulmar_ros.middleware import set_up_middleware
set_up_middleware()
rclpy.init()
node = rclpy.create_node("laptop", namespace="/floating_platform")
qos = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
goal = PoseStamped()
goal.header.frame_id, goal.header.stamp = "odom", node.get_clock().now().to_msg()
goal.pose.position.x, goal.pose.orientation.w = 4.0, 1.0
publisher = node.create_publisher(PoseStamped, "goal_pose", qos)
publisher.publish(goal)
print("published", flush=True)
time.sleep(300)
"""
# The words behind it run with the unit's own view of the file system; $1 is the folder that stands for StateDirectory.
SANDBOX = """
mount --bind /tmp /tmp
mount -t tmpfs -o mode=0755 run /run && mkdir /run/fulmar-mock_lqr
mount --bind / / && mount -o remount,bind,ro /
cd "$1" && shift && exec "$@"
"""
Start = Callable[..., psutil.Popen]


@pytest.fixture
def start(neighbour: Neighbour, ros_domain: RosDomain, tmp_path: Path) -> Iterator[Start]:
    """Installs a service, and starts what its unit starts; none outlives its test."""
    neighbour.withdraw_command()
    started: list[psutil.Popen] = []

    def begin(system: str, *more: str, also: tuple[str, ...] = (), within: str = "") -> psutil.Popen:
        root = tmp_path / "root"
        asked = ("service", "install", system, *more, "--user", "games", "--root", str(root))
        done = fulmar(*asked, env=ros_domain.env, cwd=tmp_path)
        assert done.returncode == DONE, done.stderr
        (unit,) = (root / UNITS).glob("fulmar-*.service")
        text = unit.read_text()
        command, env = [*command_of(text), *also], dict(ros_domain.env)
        if within:
            command = ["unshare", "--mount", "bash", "-euc", within, "within", str(tmp_path), *command]
            env |= dict(line.split("=", 1) for line in re.findall(r"^Environment=(.*)$", text, re.MULTILINE))
            env["HOME"] = "/nonexistent"
        process = psutil.Popen(command, env=env, cwd=tmp_path, stdin=subprocess.DEVNULL)
        started.append(process)
        return process

    yield begin
    for process in started:
        if process.poll() is None:
            for each in [*process.children(recursive=True), process]:
                each.kill()
        process.wait(10.0)


def ready(neighbour: Neighbour) -> None:
    """Wait until plant and controller run."""
    until(lambda: bool(neighbour.applied) and "controller" in neighbour.said, 30.0)


def stands_still(neighbour: Neighbour) -> bool:
    """Whether no actuator moves for a while."""
    begin = len(neighbour.applied)
    time.sleep(STILL_S)
    later = neighbour.applied[begin:]
    return len(later) > 10 and not any(applied.any() for applied in later)


def refusal(neighbour: Neighbour) -> str:
    """Why the controller refused the newest goal."""
    return neighbour.said["controller"][1].get("goal_refused", "")


def reset(neighbour: Neighbour) -> None:
    """As a person does."""
    assert all(done for done, _ in Operator(neighbour.node).reset_all(ROBOT).values())


@pytest.mark.slow
def test_nothing_moves_until_a_reset_and_a_goal_that_comes_after_it(
    neighbour: Neighbour, start: Start
) -> None:
    neighbour.give_goal()  # latched, from before the boot
    service = start("mock_lqr")
    ready(neighbour)
    until(lambda: neighbour.said["estop"][0] == "pressed")
    assert stands_still(neighbour)
    neighbour.give_goal()  # while it is pressed
    assert stands_still(neighbour)
    reset(neighbour)
    until(lambda: neighbour.said["estop"][0] == "released")
    assert stands_still(neighbour), "a goal from before the reset was obeyed"
    neighbour.give_goal()
    until(lambda: neighbour.applied[-1].any())
    _ends_with_closed_valves(neighbour, service, [service])


@pytest.mark.slow
def test_a_latched_goal_that_arrives_after_the_reset_from_before_it_does_not_count(
    neighbour: Neighbour, start: Start, ros_domain: RosDomain, tmp_path: Path
) -> None:
    """As of a laptop that slept while the robot started."""
    (tmp_path / "laptop.py").write_text(LAPTOP)
    laptop = psutil.Popen(
        [sys.executable, "laptop.py"], env=ros_domain.env, cwd=tmp_path, stdout=subprocess.PIPE
    )
    try:
        assert laptop.stdout.readline() == b"published\n"
        laptop.suspend()
        service = start("mock_lqr")
        ready(neighbour)
        reset(neighbour)
        until(lambda: neighbour.said["estop"][0] == "released")
        laptop.resume()
        until(lambda: "before the e-stop was reset" in refusal(neighbour), 20.0)
        assert stands_still(neighbour)
        neighbour.give_goal()
        until(lambda: neighbour.applied[-1].any())
        _ends_with_closed_valves(neighbour, service, [service])
    finally:
        laptop.kill()
        laptop.wait()


@pytest.mark.slow
def test_the_command_starts_within_what_the_unit_lets_it_write(
    neighbour: Neighbour, start: Start, tmp_path: Path
) -> None:
    """Everything is read-only but /run, /tmp and /dev/shm, and there is no home, as below ProtectSystem=strict."""
    start("mock_lqr", within=SANDBOX)
    ready(neighbour)
    until(lambda: neighbour.said["estop"][0] == "pressed")


@pytest.mark.slow
@pytest.mark.parametrize(
    "whole_group", [False, True], ids=["the command alone", "every process, as systemd does"]
)
def test_sigterm_closes_valves_of_a_driver_within_a_second(
    whole_group: bool, neighbour: Neighbour, start: Start
) -> None:
    service = start("mujoco_lqr", "--backend", "hardware", also=("--emulate",))
    ready(neighbour)
    reset(neighbour)
    until(lambda: neighbour.said["estop"][0] == "released")
    neighbour.give_goal()
    until(lambda: neighbour.applied[-1].any(), 20.0)
    asked = [service, *service.children(recursive=True)] if whole_group else [service]
    _ends_with_closed_valves(neighbour, service, asked)


@pytest.mark.slow
def test_after_a_crash_and_a_restart_it_stands_still_again(neighbour: Neighbour, start: Start) -> None:
    first = start("mock_lqr")
    ready(neighbour)
    reset(neighbour)
    neighbour.give_goal()
    until(lambda: neighbour.applied[-1].any())
    nodes = first.children(recursive=True)
    first.kill()
    began = time.monotonic()
    until(lambda: not neighbour.applied[-1].any())
    assert time.monotonic() - began < CLOSED_S
    _gone, alive = psutil.wait_procs(nodes, timeout=10.0)
    assert not alive
    neighbour.said.clear()
    neighbour.applied.clear()
    start("mock_lqr")
    ready(neighbour)
    until(lambda: neighbour.said["estop"][0] == "pressed")
    assert stands_still(neighbour), "the goal of before the crash was obeyed"


@pytest.mark.slow
@pytest.mark.parametrize("neighbour", ["kingfisher"], indirect=True)
def test_a_file_that_arms_does_not_arm_in_a_service(
    neighbour: Neighbour, tmp_path: Path, start: Start
) -> None:
    text = config_path("hardware", "kingfisher_ardupilot").read_text()
    (tmp_path / "armed.yaml").write_text(text.replace("arm: false", "arm: true"))
    more = ("--robot", "kingfisher", "--backend", "hardware", "--hardware", str(tmp_path / "armed.yaml"))
    start("mujoco_classical", *more, also=("--emulate",))
    until(lambda: neighbour.said["plant"][1].get("warning", "").startswith("not armed"), 40.0)
    assert neighbour.said["plant"][1]["armed"] == "false"


def _ends_with_closed_valves(
    neighbour: Neighbour, service: psutil.Popen, asked: list[psutil.Process]
) -> None:
    began = time.monotonic()
    for process in asked:
        os.kill(process.pid, signal.SIGTERM)
    until(lambda: not neighbour.applied[-1].any())
    assert time.monotonic() - began < CLOSED_S
    nodes = service.children(recursive=True)
    assert service.wait(15.0) == DONE
    assert not psutil.wait_procs(nodes, timeout=5.0)[1]
    assert not neighbour.applied[-1].any()
