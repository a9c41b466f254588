"""`fulmar up`: goals, a swap, an e-stop and its reset in one system, each as an event; whole bags at the end."""

from __future__ import annotations

import json
import signal
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import psutil
import pytest
from geometry_msgs.msg import PoseStamped
from rclpy.duration import Duration

from fulmar_bags.run_record import read_run
from fulmar_bringup.robot_operator import Operator
from fulmar_core.config.errors import BAD_USAGE, DONE, FAILED
from fulmar_core.tasks.goal import goal_at
from fulmar_ros.goal_messages import goal_message
from policy_server.controllers import shipped_policy
from tests.conftest import RosDomain
from tests.ros.cli import child_running, fulmar, start_fulmar
from tests.ros.controllers import copy_of
from tests.ros.neighbour import ROBOT, Neighbour, until

real_time = pytest.mark.real_time

LOAD = ("fault", "recovered")  # of a busy machine, four times as fast as the clock
RECORDED = ("--json", "--record", "bag")


class Up:
    """A running system, and the events that it has printed."""

    def __init__(self, system: str, *more: str, env: dict[str, str], cwd: Path) -> None:
        self.process: psutil.Popen = start_fulmar("up", system, *RECORDED, *more, env=env, cwd=cwd)
        self.events: list[dict[str, Any]] = []
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        for line in self.process.stdout:
            self.events.append(json.loads(line))

    @property
    def names(self) -> list[str]:
        return [event["event"] for event in self.events]

    def wait_for(self, name: str, times: int = 1, timeout_s: float = 30.0) -> None:
        """Until an event has come so often."""
        try:
            until(lambda: self.names.count(name) >= times, timeout_s)
        except AssertionError as error:
            raise AssertionError(f"no {name} for the {times}. time in {self.events}") from error

    def end(self, number: signal.Signals) -> None:
        """Send a signal, and wait for the end."""
        self.process.send_signal(number)
        code = int(self.process.wait(20.0))
        self.wait_for("stopped")
        assert code == DONE, self.events[-1]


@pytest.fixture
def start(neighbour: Neighbour, ros_domain: RosDomain, tmp_path: Path) -> Iterator[Any]:
    neighbour.withdraw_command()  # a plant obeys no two nodes
    started: list[Up] = []

    def begin(system: str, *more: str) -> Up:
        started.append(Up(system, *more, env=ros_domain.env, cwd=tmp_path))
        return started[-1]

    yield begin
    for up in started:
        if up.process.poll() is None:
            up.process.kill()


def give(neighbour: Neighbour, x: float, y: float) -> None:
    """A goal of a node with the default quality of service, which leaves at once."""
    publisher = neighbour.node.create_publisher(PoseStamped, "goal_pose", 10)
    until(lambda: publisher.get_subscription_count() >= 2)
    neighbour.node.get_clock().sleep_for(Duration(seconds=0.1))
    publisher.publish(goal_message(goal_at((x, y, 0.0)), "goal_pose", 0))
    publisher.wait_for_all_acked(Duration(seconds=1.0))
    neighbour.node.destroy_publisher(publisher)


@real_time
@pytest.mark.slow
def test_three_goals_a_swap_an_e_stop_its_reset_and_another_goal_follow_each_other(
    neighbour: Neighbour, start: Any, tmp_path: Path
) -> None:
    up = start("mujoco_policy", "--recording", "goals", "--rate", "4")
    up.wait_for("started")
    for number, place in enumerate(((0.4, 0.0), (0.4, 0.4), (0.0, 0.0)), start=1):
        give(neighbour, *place)
        up.wait_for("reached", number)
    second = copy_of(tmp_path, "second")
    person = Operator(neighbour.node)
    assert person.ask_swap(ROBOT, bundle=str(second), find_s=5.0, answer_s=10.0).accepted
    up.wait_for("swapped")
    assert all(stopped.reached for stopped in person.stop_all(ROBOT))
    up.wait_for("estop")
    assert all(done for done, _ in person.reset_all(ROBOT).values())
    up.wait_for("reset")
    give(neighbour, 0.4, 0.0)
    up.wait_for("reached", 4)
    up.end(signal.SIGTERM)
    assert [name for name in up.names if name not in ("goal_refused", *LOAD)] == [
        "started", *["goal", "reached"] * 3, "swapped", "estop", "reset", "goal", "reached", "stopping", "stopped",
    ]  # fmt: skip
    stopping, stopped = up.events[-2:]
    assert stopping["reason"] == "stopped by SIGTERM"
    assert (stopped["failure"], len(stopped["bags"])) == (None, 4)
    for number, bag in enumerate(stopped["bags"]):
        record = read_run(tmp_path / bag)
        assert not record.warnings
        assert len(record.goals) == (2 if number < 3 else 1)  # its own, and the one that ended it
    assert not record.applied.effort[-1].any()


@real_time
@pytest.mark.slow
def test_the_controller_of_a_recorded_system_takes_every_swap(
    seed_of_series: int, neighbour: Neighbour, ros_domain: RosDomain, start: Any, tmp_path: Path
) -> None:
    """To a copy and back, each asked by a command of its own."""
    up = start("mock_policy")
    up.wait_for("started")
    second = copy_of(tmp_path, "second")
    for number, folder in enumerate([second, shipped_policy(ROBOT, "go_to_pose")] * 5, start=1):
        done = fulmar("swap", ROBOT, str(folder), env=ros_domain.env, cwd=tmp_path)
        assert done.returncode == DONE, done.stderr
        up.wait_for("swapped", number)
    up.end(signal.SIGTERM)


@real_time
@pytest.mark.slow
def test_ctrl_c_counts_no_trip_and_one_bag_holds_all(
    neighbour: Neighbour, start: Any, tmp_path: Path
) -> None:
    up = start("mock_lqr")
    up.wait_for("started")
    give(neighbour, 1.0, 0.0)
    up.wait_for("goal")
    until(lambda: bool(neighbour.commands) and neighbour.commands[-1].any())
    up.end(signal.SIGINT)
    assert up.names == ["started", "goal", "stopping", "stopped"]
    assert up.events[-1]["watchdog_trips"] == 0
    assert up.events[-1]["bags"] == ["bag"]
    assert not read_run(tmp_path / "bag").warnings


@real_time
@pytest.mark.slow  # as in `fulmar run`
def test_a_node_that_dies_ends_the_system_with_its_name_and_a_whole_bag(start: Any, tmp_path: Path) -> None:
    up = start("mock_lqr")
    up.wait_for("started")
    child_running(up.process, "policy_server.controller_node").kill()
    assert up.process.wait(20.0) == FAILED
    until(lambda: "stopped" in up.names)
    assert "controller was killed by SIGKILL" in up.events[-1]["failure"]
    record = read_run(tmp_path / "bag")
    assert not record.warnings
    assert not record.applied.effort[-1].any()


def test_an_unknown_system_is_refused_with_the_nearest_name(fulmar: Any) -> None:
    code, _, said = fulmar("up", "mujoco_lqrr")
    assert code == BAD_USAGE
    assert "mujoco_lqr" in said
    assert len(said.strip().splitlines()) == 1
