"""Fleets through ROS: lock step gives the same bytes, nothing crosses, and a fault of one leaves the others alone."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Any

import numpy as np
import psutil
import pytest
import rclpy
from std_msgs.msg import Bool, String

from fulmar_bags.contents import open_bag
from fulmar_bags.run_record import RunRecord, read_run
from fulmar_bringup.launched_system import list_nodes
from fulmar_bringup.processes import ProcessGroup
from fulmar_core.robots.topics import FLEET_ESTOP, FLEET_STATUS
from fulmar_ros.qos import publisher_qos, subscriber_qos
from fulmar_ros.runtime import ros_node
from tests.conftest import RosDomain
from tests.ros.cli import child_running, fulmar, start_fulmar

NAMES = ("alpha", "beta", "boat")
FILE = """\
title: two platforms and a boat
control_hz: 10.0
least_distance: 0.02
robots:
  - {name: alpha, robot: floating_platform, task: go_to_pose, controller: lqr, start: [0.0, 0.0, 0.0],
     goal: [-1.0, 0.5, 90.0], keep_apart: true}
  - {name: beta, robot: floating_platform, task: go_to_pose, controller: lqr, start: [3.0, 0.0, 0.0],
     goal: [3.0, 1.0, 0.0], keep_apart: true}
  - {name: boat, robot: kingfisher, task: go_to_position, controller: classical, start: [0.0, -4.0, 0.0],
     goal: [3.0, -4.0]}
"""
WATCHDOG_S = 0.5  # in which a robot is safe


@pytest.fixture
def fleet(ros_domain: RosDomain, tmp_path: Path) -> dict[str, str]:
    """Environment in which `trio` is a fleet."""
    folder = tmp_path / "configs" / "systems"
    folder.mkdir(parents=True)
    (folder / "trio.yaml").write_text(FILE)
    return {**ros_domain.env, "FULMAR_CONFIGS": str(tmp_path / "configs")}


def run(env: dict[str, str], cwd: Path, record: str, *more: str) -> dict[str, Any]:
    done = fulmar(
        "run", "--system", "trio", "--record", record, "--json", *more, env=env, cwd=cwd, timeout_s=120.0
    )
    assert done.stdout.startswith("{"), done.stderr
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def check_nothing_crosses(bag: Path) -> None:
    """Assert that each robot did what its own controller commanded, for goals in its own frame, and no other's."""
    records = {name: read_run(bag, name) for name in NAMES}
    for name, record in records.items():
        stamps, mine, applied = np.intersect1d(
            record.commanded.stamp_s, record.applied.stamp_s, return_indices=True
        )
        assert len(stamps) > 50
        np.testing.assert_allclose(record.commanded.effort[mine], record.applied.effort[applied], atol=1e-6)
        assert len(record.goals) >= 1
        assert {tuple(np.round(goal.targets[0, :2], 3)) for goal in record.goals} == {GOALS[name]}
        opened = open_bag(bag).of_robot(name)
        assert not any(
            topic.startswith(tuple(f"/{other}/" for other in NAMES if other != name))
            for topic in opened.topics
        )
    first, second = records["alpha"].commanded.effort, records["beta"].commanded.effort
    assert not np.array_equal(first[: len(second)], second[: len(first)])


GOALS = {"alpha": (-1.0, 0.5), "beta": (3.0, 1.0), "boat": (3.0, -4.0)}


@pytest.mark.slow
def test_lock_step_of_a_fleet_gives_the_same_bytes_twice_and_nothing_crosses(
    fleet: dict[str, str], tmp_path: Path
) -> None:
    results = [run(fleet, tmp_path, record, "--lockstep", "--duration", "30") for record in ("one", "two")]
    for result in results:
        assert result["success"], result["failure"]
        assert result["least_distance_m"] > 0.5
    for name in NAMES:
        bags = [open_bag(tmp_path / record).of_robot(name) for record in ("one", "two")]
        for wire in (
            "odom",
            "ground_truth/odom",
            "actuators/state",
            "controller/observation",
            "controller/action",
        ):
            one, two = (b"".join(bytes(data) for data in bag.topics[f"/{name}/{wire}"].data) for bag in bags)
            assert one and one == two, f"{name}: {wire}"
    check_nothing_crosses(tmp_path / "one")
    about = json.loads(fulmar("bag", "info", "one", "--json", env=fleet, cwd=tmp_path).stdout)
    assert set(about["robots"]) == set(NAMES)
    again = fulmar("bag", "rerun", "one", "--robot", "beta", "--json", env=fleet, cwd=tmp_path)
    assert json.loads(again.stdout)["same"], again.stdout
    refused = fulmar("bag", "rerun", "one", env=fleet, cwd=tmp_path)
    assert refused.returncode == 2 and "--robot alpha or beta or boat" in refused.stderr


@pytest.mark.slow
def test_each_robot_has_a_bag_of_its_own_that_says_what_the_one_of_all_says(
    fleet: dict[str, str], tmp_path: Path
) -> None:
    result = run(fleet, tmp_path, "bags", "--lockstep", "--duration", "25", "--record-each")
    assert result["success"] and result["least_distance_m"] > 0.5, result["failure"]
    assert not (tmp_path / "bags" / "metadata.yaml").exists()
    for name in NAMES:
        record = read_run(tmp_path / "bags" / name)
        assert record.info["name"] == name and record.info["fleet"] == "trio"
        assert {tuple(np.round(goal.targets[0, :2], 3)) for goal in record.goals} == {GOALS[name]}
    again = fulmar("bag", "rerun", "bags/alpha", "--json", env=fleet, cwd=tmp_path)
    assert json.loads(again.stdout)["same"], again.stdout


def controller_of(name: str, parent: psutil.Popen) -> psutil.Process:
    """The controller's process of a robot."""
    child_running(parent, "policy_server.controller_node")
    until = time.monotonic() + 20.0
    while time.monotonic() < until:
        for child in parent.children(recursive=True):
            if "policy_server.controller_node" in child.cmdline() and f"__ns:=/{name}" in child.cmdline():
                return child
        time.sleep(0.05)
    raise AssertionError(f"no controller of {name}")


class Watcher:
    """Reads the status of a fleet, and presses its e-stop."""

    def __init__(self, node: rclpy.node.Node) -> None:
        self.newest: dict[str, Any] = {}
        qos = subscriber_qos(FLEET_STATUS)
        node.create_subscription(String, FLEET_STATUS.name, self._take, qos)
        self._press = node.create_publisher(Bool, FLEET_ESTOP.name, publisher_qos(FLEET_ESTOP))

    def _take(self, message: String) -> None:
        self.newest = json.loads(message.data)

    def press(self) -> None:
        self._press.publish(Bool(data=True))

    def wait_s(self, time_s: float, within_s: float = 60.0) -> None:
        """Until the fleet's time has come that far."""
        until = time.monotonic() + within_s
        while self.newest.get("time_s", 0.0) < time_s:
            assert time.monotonic() < until, self.newest
            time.sleep(0.02)


def still_after(record: RunRecord, time_s: float) -> bool:
    """Whether the actuators of a robot are at rest from a time after the begin of its record on."""
    later = record.applied.stamp_s > record.applied.stamp_s[0] + time_s
    return bool(later.any()) and not record.applied.effort[later].any()


def disturbed_run(env: dict[str, str], cwd: Path, do: Any) -> dict[str, Any]:
    """Run in real time, do something at 3 s, and return the result with that time as `at_s`."""
    process = start_fulmar(
        "run", "--system", "trio", "--duration", "20", "--record", "bag", "--json", env=env, cwd=cwd
    )
    with ros_node("watcher", lambda error: pytest.fail(repr(error))) as node:
        watcher = Watcher(node)
        watcher.wait_s(3.0)
        at_s = watcher.newest["time_s"]
        do(watcher, process)
        output, errors = process.communicate(timeout=90.0)
    assert output.startswith("{"), errors
    return {**json.loads(output), "at_s": at_s}


@pytest.mark.slow
@pytest.mark.real_time
def test_a_controller_that_is_killed_leaves_its_robot_safe_and_the_others_arrive(
    fleet: dict[str, str], tmp_path: Path
) -> None:
    result = disturbed_run(fleet, tmp_path, lambda _, process: controller_of("alpha", process).kill())
    assert "controller was killed by SIGKILL" in result["robots"]["alpha"]["failure"]
    assert still_after(read_run(tmp_path / "bag", "alpha"), result["at_s"] + 1.0 + WATCHDOG_S)
    for name in ("beta", "boat"):
        assert result["robots"][name]["success"], result["robots"][name]
        assert result["robots"][name]["watchdog_trips"] == 0


@pytest.mark.slow
@pytest.mark.real_time
def test_the_e_stop_of_one_stops_it_alone(fleet: dict[str, str], tmp_path: Path) -> None:
    def press_one(_watcher: Watcher, _process: psutil.Popen) -> None:
        assert fulmar("estop", "alpha", env=fleet, cwd=tmp_path).returncode == 0

    result = disturbed_run(fleet, tmp_path, press_one)
    assert result["robots"]["alpha"]["estop_pressed"]
    for name in ("beta", "boat"):
        assert result["robots"][name]["success"] and not result["robots"][name]["estop_pressed"]


@pytest.mark.slow
@pytest.mark.real_time
def test_the_e_stop_of_all_stops_every_robot(fleet: dict[str, str], tmp_path: Path) -> None:
    result = disturbed_run(fleet, tmp_path, lambda watcher, _: watcher.press())
    for name in NAMES:
        assert result["robots"][name]["estop_pressed"], name
        assert still_after(read_run(tmp_path / "bag", name), result["at_s"] + 1.0 + WATCHDOG_S)


@pytest.mark.slow
@pytest.mark.real_time
def test_a_fleet_stays_up_takes_goals_for_each_and_ends_in_order(
    fleet: dict[str, str], tmp_path: Path
) -> None:
    process = start_fulmar("up", "trio", "--record", "bag", "--json", env=fleet, cwd=tmp_path)
    with ros_node("watcher", lambda error: pytest.fail(repr(error))) as node:
        watcher = Watcher(node)
        watcher.wait_s(1.0)
        asked = ("goals", "--robot", "kingfisher", "--name", "boat", "--pose", "3,-4")
        assert fulmar(*asked, env=fleet, cwd=tmp_path).returncode == 0
        until = time.monotonic() + 40.0
        while (watcher.newest["robots"]["boat"]["goal_distance_m"] or 9.0) > 0.2:
            assert time.monotonic() < until, watcher.newest
            time.sleep(0.1)
        status = watcher.newest["robots"]
    process.terminate()
    output, errors = process.communicate(timeout=40.0)
    events = [json.loads(line) for line in output.splitlines()]
    assert process.returncode == 0, errors
    assert {each["name"] for each in events if each["event"] == "started"} == set(NAMES)
    assert {each["name"] for each in events if each["event"] in ("goal", "reached")} == {"boat"}
    assert status["alpha"]["goal_distance_m"] is None and status["alpha"]["mode"] == "running"
    assert events[-1]["event"] == "stopped" and events[-1]["failure"] is None


@pytest.mark.slow
@pytest.mark.real_time
def test_the_nodes_of_the_launch_file_run_a_fleet_without_a_supervisor(
    fleet: dict[str, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As `ros2 launch` starts them: nothing configures the plants, and goals come from elsewhere."""
    monkeypatch.setenv("FULMAR_CONFIGS", fleet["FULMAR_CONFIGS"])
    monkeypatch.chdir(tmp_path)
    groups: dict[str, ProcessGroup] = {}
    try:
        for spec in list_nodes(system="trio"):
            groups.setdefault(spec.namespace, ProcessGroup()).start(spec)
        with ros_node("watcher", lambda error: pytest.fail(repr(error))) as node:
            watcher = Watcher(node)
            watcher.wait_s(1.0)
            asked = ("goals", "--robot", "kingfisher", "--name", "boat", "--pose", "3,-4")
            assert fulmar(*asked, env=fleet, cwd=tmp_path).returncode == 0
            until = time.monotonic() + 40.0
            while (watcher.newest["robots"]["boat"]["goal_distance_m"] or 9.0) > 0.2:
                assert time.monotonic() < until, watcher.newest
                time.sleep(0.1)
            assert {each["mode"] for each in watcher.newest["robots"].values()} == {"running"}
    finally:
        for group in groups.values():
            group.stop_all()
