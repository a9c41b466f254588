"""A running controller gives way to another by its name: to laws, policies and a person; each request is answered."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable, Iterator

import pytest
from rclpy.node import Node
from std_msgs.msg import Bool, String

from fulmar_bringup.estop_robots import release_without_node
from fulmar_bringup.robot_operator import Operator
from fulmar_core.robots.topics import ESTOP, SWAP, SWAP_RESULT
from fulmar_ros.controller_node import ControllerNode
from fulmar_ros.qos import publisher_qos, subscriber_qos
from fulmar_ros.runtime import spinning
from policy_server.controller_node import make_controller
from tests.ros.neighbour import NAMESPACE, ROBOT, Neighbour, Stream, until

pytestmark = pytest.mark.real_time
Asked = Callable[..., dict[str, object]]


@pytest.fixture
def law(neighbour: Neighbour, monkeypatch: pytest.MonkeyPatch) -> Iterator[ControllerNode]:
    """An LQR that acts on good odometry."""
    monkeypatch.setattr(sys, "argv", ["controller_node"])
    arguments = ["--ros-args", "-r", f"__ns:={NAMESPACE}", "-p", "control_hz:=5.0", "-p", "controller:=lqr"]
    node = ControllerNode(make_controller, lambda _code: None, cli_args=arguments)
    with spinning(node, lambda error: pytest.fail(repr(error))):
        neighbour.give_goal()
        odometry = Stream(neighbour)
        until(lambda: bool(neighbour.commands) and neighbour.commands[-1].any())
        yield node
        odometry.stop()
        node.stop()


@pytest.fixture
def ask(neighbour: Neighbour, law: ControllerNode) -> Asked:
    """Sends a request, and returns its answer."""
    answers: list[dict[str, object]] = []
    neighbour.node.create_subscription(
        String,
        SWAP_RESULT.name,
        lambda message: answers.append(json.loads(message.data)),
        subscriber_qos(SWAP_RESULT, reliable=True),
    )
    publisher = neighbour.node.create_publisher(String, SWAP.name, publisher_qos(SWAP))
    numbers = iter(range(1, 100))

    def send(**request: object) -> dict[str, object]:
        until(lambda: publisher.get_subscription_count() > 0)
        number = next(numbers)
        publisher.publish(String(data=json.dumps({"id": number, "by": "alice", **request})))
        until(lambda: any(answer["id"] == number for answer in answers), timeout_s=20.0)
        return next(answer for answer in answers if answer["id"] == number)

    return send


def said(neighbour: Neighbour, key: str) -> str:
    return neighbour.said["controller"][1].get(key, "")


def test_a_law_gives_way_to_a_policy_to_another_law_and_to_a_person_and_takes_over_again(
    neighbour: Neighbour, ask: Asked
) -> None:
    for name in ("policy", "mpc", "lqr"):
        answer = ask(controller=name)
        assert (answer["accepted"], answer["by"]) == (True, "alice"), answer["reason"]
        assert int(answer["stamp_ns"]) > 0
        until(lambda name=name: said(neighbour, "controller") == name)
        assert said(neighbour, "sha256") == answer["sha256"]
        until(lambda: bool(neighbour.commands[-1].any()))
    assert ask(controller="teleoperation")["accepted"]
    until(lambda: said(neighbour, "controller") == "teleoperation")
    time.sleep(0.5)
    assert not any(command.any() for command in neighbour.commands[-3:])
    assert ask(controller="lqr")["accepted"]
    until(lambda: bool(neighbour.commands[-1].any()))


def test_a_name_that_there_is_not_is_refused_with_the_nearest_one_and_the_law_goes_on(
    neighbour: Neighbour, ask: Asked
) -> None:
    answer = ask(controller="polciy")
    assert (answer["accepted"], answer["stamp_ns"]) == (False, 0)
    assert "Did you mean 'policy'?" in str(answer["reason"])
    assert not ask(bundle="/nowhere")["accepted"]
    assert "unknown controller 'fallback'" in str(ask(controller="fallback")["reason"])
    assert said(neighbour, "controller") == "lqr"
    until(lambda: bool(neighbour.commands[-1].any()))


def test_while_an_e_stop_holds_a_controller_takes_over_and_moves_nothing_before_a_new_goal(
    neighbour: Neighbour, ask: Asked
) -> None:
    stranger = Node("stranger")
    estop = stranger.create_publisher(Bool, f"{NAMESPACE}/{ESTOP.name}", publisher_qos(ESTOP))
    until(lambda: estop.get_subscription_count() > 0)
    time.sleep(0.2)
    estop.publish(Bool(data=True))
    until(lambda: said(neighbour, "reason").startswith("e-stop: pressed"))
    assert ask(controller="policy")["accepted"]
    until(lambda: said(neighbour, "controller") == "policy")
    time.sleep(0.5)
    assert not any(command.any() for command in neighbour.commands[-3:])
    stranger.destroy_node()
    assert release_without_node(neighbour.node, NAMESPACE)[0]
    time.sleep(0.5)
    assert not any(command.any() for command in neighbour.commands[-3:])
    neighbour.give_goal()
    until(lambda: bool(neighbour.commands[-1].any()))


def test_two_operators_are_each_answered(neighbour: Neighbour, law: ControllerNode) -> None:
    first, second = Operator(neighbour.node), Operator(neighbour.node)
    assert first.ask_swap(ROBOT, controller="mpc", find_s=5.0, answer_s=20.0).accepted
    answer = second.ask_swap(ROBOT, controller="lqr", find_s=5.0, answer_s=20.0)
    assert (answer.accepted, answer.reason) == (True, "lqr controls")
    until(lambda: said(neighbour, "controller") == "lqr")
