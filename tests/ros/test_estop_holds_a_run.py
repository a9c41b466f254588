"""`fulmar run --estop` in real time: one volatile press holds the robot; after reset and a new goal it goes on."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from geometry_msgs.msg import PoseStamped
from rclpy.duration import Duration
from std_msgs.msg import Bool
from std_srvs.srv import Trigger

from fulmar_core.robots.topics import ESTOP, ESTOP_RESET, GOAL_POSE
from fulmar_core.tasks.goal import goal_at
from fulmar_ros.goal_messages import goal_message
from tests.conftest import RosDomain
from tests.ros.cli import json_of, start_fulmar
from tests.ros.neighbour import Neighbour, until

pytestmark = [pytest.mark.real_time, pytest.mark.slow]

FAR = ("--start", "3,0,0", "--goal", "0,0,0", "--duration", "60", "--rate", "3")


def test_a_run_goes_on_after_an_e_stop_its_reset_and_a_new_goal(
    neighbour: Neighbour, ros_domain: RosDomain, tmp_path: Path
) -> None:
    neighbour.withdraw_command()  # a plant obeys no two nodes
    run = start_fulmar(
        "run", "floating_platform", "--controller", "lqr", "--backend", "mock", "--estop", *FAR, "--record", "bag",
        "--json", env=ros_domain.env, cwd=tmp_path,
    )  # fmt: skip
    node = neighbour.node

    def moves() -> bool:
        return any(np.any(applied) for applied in neighbour.applied[-20:])

    def send(kind: type, topic: str, message: object) -> None:
        publisher = node.create_publisher(kind, topic, 10)
        until(lambda: publisher.get_subscription_count() > 0)
        node.get_clock().sleep_for(Duration(seconds=0.1))
        publisher.publish(message)
        publisher.wait_for_all_acked(Duration(seconds=1.0))
        node.destroy_publisher(publisher)

    until(lambda: bool(neighbour.applied) and moves(), 30.0)
    send(Bool, ESTOP.name, Bool(data=True))
    until(lambda: not moves(), 3.0)
    node.get_clock().sleep_for(Duration(seconds=1.0))
    assert not moves()
    assert "e-stop: pressed" in neighbour.said["plant"][0]
    reset = node.create_client(Trigger, ESTOP_RESET)
    assert reset.wait_for_service(5.0)
    answer = reset.call_async(Trigger.Request())
    until(answer.done)
    assert answer.result().success, answer.result().message
    node.get_clock().sleep_for(Duration(seconds=0.5))
    assert not moves()  # not before there is a new goal
    send(PoseStamped, GOAL_POSE.name, goal_message(goal_at((2.0, 1.0, 0.0)), "goal_pose", 0))
    until(moves, 5.0)
    out, err = run.communicate(timeout=60.0)
    summary = json_of(out)
    assert summary["failure"] is None, err
    assert summary["estop_pressed"] is True
    assert summary["success"] is True, summary
    assert run.returncode == 0
