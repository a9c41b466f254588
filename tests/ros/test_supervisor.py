"""The operator's side of a run, against plants that do not do as they are reported."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Iterator
from dataclasses import replace

import pytest
import rclpy
from geometry_msgs.msg import PoseStamped
from lifecycle_msgs.srv import ChangeState
from rclpy.node import Node
from std_msgs.msg import Bool, String

from fulmar_bringup.run_plan import RunPlan
from fulmar_bringup.supervisor import Supervisor, supervisor
from fulmar_core.config.errors import RunFailed
from fulmar_core.robots.topics import ESTOP, ESTOP_RELEASED, GOAL_POSE
from fulmar_core.tasks.goal import goal_at
from fulmar_ros.controller_node import ControllerNode
from fulmar_ros.living_plant import TwinRunError
from fulmar_ros.operator_subscription import subscribe_every
from fulmar_ros.qos import publisher_qos
from fulmar_ros.runtime import spinning
from tests.conftest import RosDomain
from tests.ros.controllers import make_lqr
from tests.ros.neighbour import NAMESPACE, until

real_time = pytest.mark.real_time

PLAN = RunPlan("floating_platform", "go_to_pose", "lqr", "mock", 50.0)


@pytest.mark.parametrize(
    ("refused", "words"),
    [(1, "plant: could not be configured: no model"), (3, "plant: could not be activated: no model")],
)
def test_a_plant_that_refuses_to_start_fails_the_run_with_its_own_reason(
    refused: int, words: str, ros_domain: RosDomain
) -> None:
    """Both steps of its start, in ROS' numbers of transitions."""

    def answer(request: ChangeState.Request, response: ChangeState.Response) -> ChangeState.Response:
        response.success = request.transition.id != refused
        return response

    with supervisor(PLAN) as overseer:
        plant = rclpy.create_node("plant", namespace="/floating_platform")
        plant.create_service(ChangeState, "plant/change_state", answer)
        with spinning(plant, overseer.fail), pytest.raises(RunFailed) as caught:
            overseer.start_plant(lambda: None, lambda: "no model")
    assert str(caught.value) == words


def test_a_run_whose_plant_is_there_twice_is_refused_with_every_node_that_is(ros_domain: RosDomain) -> None:
    """As long as there is one of each, nothing is said; a neighbour of another name does not count."""
    with supervisor(PLAN) as overseer:
        nodes = [rclpy.create_node(name, namespace=NAMESPACE) for name in ("plant", "controller", "recorder")]
        nodes.append(rclpy.create_node("plant", namespace="/another"))
        until(lambda: overseer._node.get_node_names().count("plant") == 2)
        overseer.refuse_twins()
        nodes += [rclpy.create_node(name, namespace=NAMESPACE) for name in ("plant", "controller")]
        until(lambda: overseer._node.get_node_names().count("controller") == 2)
        with pytest.raises(TwinRunError) as caught:
            overseer.refuse_twins()
    assert str(caught.value) == (
        f"another run of this name goes on in ROS domain {ros_domain.id}: {NAMESPACE}/plant, {NAMESPACE}/controller "
        "are there twice, and two of one name would mix. Wait for it to end, give this robot another --name, or set "
        "ROS_DOMAIN_ID to another number."
    )


@pytest.mark.parametrize("standing", [False, True])
def test_a_launcher_whose_goals_come_from_outside_publishes_none_itself(
    standing: bool, ros_domain: RosDomain
) -> None:
    """Its latched publisher would make plain ones warn of the subscriptions that it needs."""
    with supervisor(replace(PLAN, standing=standing)) as overseer:
        assert overseer._node.count_publishers(f"{NAMESPACE}/{GOAL_POSE.name}") == (not standing)


class Button:
    """An e-stop that says what a test wants, twenty times a second, or nothing."""

    def __init__(self) -> None:
        self.pressed: bool | None = False
        self._node = rclpy.create_node("button", namespace=NAMESPACE)
        self._publisher = self._node.create_publisher(Bool, ESTOP.name, publisher_qos(ESTOP))
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _run(self) -> None:
        while not self._over.wait(0.05):
            if self.pressed is not None:
                self._publisher.publish(Bool(data=self.pressed))

    def stop(self) -> None:
        self._over.set()
        self._thread.join()
        self._node.destroy_node()  # not before: the thread publishes


@pytest.fixture
def operated(
    ros_domain: RosDomain, monkeypatch: pytest.MonkeyPatch
) -> Iterator[tuple[Supervisor, Button, Node]]:
    """A supervisor of an LQR node that needs an e-stop, the e-stop, and a node for more."""
    monkeypatch.setattr(sys, "argv", ["controller_node"])
    arguments = ["--ros-args", "-r", f"__ns:={NAMESPACE}", "-p", "estop:=true"]
    with supervisor(PLAN) as overseer:
        controller = ControllerNode(make_lqr, lambda _code: None, cli_args=arguments)
        other = rclpy.create_node("other", namespace=NAMESPACE)
        button = Button()
        with spinning(controller, overseer.fail):
            until(lambda: "no odom yet" in reason(overseer))  # the e-stop is received, and released
            yield overseer, button, other
            controller.stop()
        button.stop()


def reason(overseer: Supervisor) -> str:
    return overseer.controller.values.get("reason", "")


def give(
    overseer: Supervisor, failures: list[Exception], listeners: int = 1, within_s: float = 5.0
) -> threading.Thread:
    """Give a goal from a thread."""
    until_s = time.monotonic() + within_s

    def alive() -> None:
        if time.monotonic() > until_s:
            raise RunFailed("it was not taken")

    def run() -> None:
        try:
            overseer.give_goal(goal_at((1.0, 0.0, 0.0)), time_ns=5, alive=alive, listeners=listeners)
        except RunFailed as error:
            failures.append(error)

    thread = threading.Thread(target=run)
    thread.start()
    return thread


@real_time
def test_a_goal_that_was_refused_for_a_silent_e_stop_is_reported_again(
    operated: tuple[Supervisor, Button, Node],
) -> None:
    overseer, button, _ = operated
    button.pressed = None
    until(lambda: "e-stop: silent" in reason(overseer))
    failures: list[Exception] = []
    giving = give(overseer, failures)
    until(lambda: "e-stop: silent" in overseer.controller.values.get("goal_refused", ""))
    button.pressed = False
    giving.join()
    assert not failures
    assert overseer.controller.values["goal_stamp_ns"] == "6"
    assert overseer.controller.values["goal_refused"] == ""


@real_time
def test_a_goal_that_a_silent_e_stop_took_away_before_all_were_ready_is_reported_again(
    operated: tuple[Supervisor, Button, Node],
) -> None:
    overseer, button, other = operated
    failures: list[Exception] = []
    giving = give(overseer, failures, listeners=2)
    until(lambda: overseer.controller.values.get("goal_stamp_ns") == "5")
    button.pressed = None
    until(lambda: overseer.controller.values["goal_stamp_ns"] == "0")
    button.pressed = False
    with spinning(other, overseer.fail):
        subscribe_every(other, PoseStamped, GOAL_POSE, lambda _: None)
        giving.join()
    assert not failures
    assert overseer.controller.values["goal_stamp_ns"] == "6"


@real_time
def test_a_goal_that_was_refused_for_a_pressed_e_stop_is_not_reported_again_by_itself(
    operated: tuple[Supervisor, Button, Node],
) -> None:
    overseer, button, other = operated
    button.pressed = True
    until(lambda: "e-stop: pressed" in reason(overseer))
    failures: list[Exception] = []
    giving = give(overseer, failures, within_s=1.5)
    until(lambda: overseer.controller.values.get("goal_refused", "").startswith("e-stop: pressed"))
    button.pressed = False
    released = other.create_publisher(String, ESTOP_RELEASED.name, publisher_qos(ESTOP_RELEASED))
    until(lambda: released.get_subscription_count() > 0)
    time.sleep(0.1)
    assert "e-stop: pressed" in reason(overseer)  # the node, started again, says "released"
    released.publish(String())
    until(lambda: "no odom yet" in reason(overseer))
    giving.join()
    assert failures
    assert overseer.controller.values["goal_stamp_ns"] == "0"
