"""Goals of any publisher: a plain rclpy node with default settings, volatile, and a latched one. In lock step."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
import rclpy
from geometry_msgs.msg import PointStamped, PoseArray, PoseStamped, TwistStamped
from nav_msgs.msg import Odometry, Path
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from std_msgs.msg import Bool

from fulmar_core.robots.topics import ESTOP, GOAL_POSES, GOAL_WIRES, TRUTH
from fulmar_core.tasks.goal import goal_at
from fulmar_ros.controller_node import ControllerNode
from fulmar_ros.goal_messages import goal_message
from fulmar_ros.goal_node import GoalNode
from fulmar_ros.plant_node import PlantNode
from fulmar_ros.qos import publisher_qos, subscriber_qos
from fulmar_ros.runtime import spinning
from sim_nodes.sim_node import make_backend
from tests.conftest import RosDomain
from tests.ros.controllers import make_classical
from tests.ros.neighbour import until

ROBOT = "turtlebot2"
SPACE = f"/{ROBOT}"
FIRST, SECOND = (1.0, 0.0), (1.0, 0.8)


class Watcher:
    """Where the robot has been since the newest goal, and how fast it was last."""

    def __init__(self, node: Node) -> None:
        self.places: list[tuple[float, float]] = []
        self.speed = 0.0
        node.create_subscription(Odometry, TRUTH.name, self._see, subscriber_qos(TRUTH, reliable=True))

    def _see(self, message: Odometry) -> None:
        self.places.append((message.pose.pose.position.x, message.pose.pose.position.y))
        self.speed = message.twist.twist.linear.x

    def was_at(self, place: tuple[float, float]) -> bool:
        return bool(np.min(np.linalg.norm(np.array(self.places or [(9.0, 9.0)]) - place, axis=1)) < 0.15)


@contextlib.contextmanager
def system(task: str, goals: str = "") -> Iterator[tuple[Node, Watcher]]:
    """A plant and a controller in lock step, a stranger's node, and a goal node if there are goals."""
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)

    def arguments(**more: object) -> list[str]:
        settings = {"robot": ROBOT, "lockstep": True, **more}
        return [
            "--ros-args",
            "-r",
            f"__ns:={SPACE}",
            *(a for k, v in settings.items() for a in ("-p", f"{k}:={v}")),
        ]

    def fail(error: Exception) -> None:
        pytest.fail(repr(error))

    with contextlib.ExitStack() as stack:
        stack.callback(rclpy.try_shutdown)
        stranger = Node("stranger", namespace=SPACE)
        watcher = Watcher(stranger)
        stack.enter_context(spinning(stranger, fail))
        controller = ControllerNode(
            make_classical, lambda _code: None, cli_args=arguments(task=task, goals_streamed=bool(goals))
        )
        stack.enter_context(spinning(controller, fail))
        plant = PlantNode(make_backend, lambda _code: None, cli_args=arguments(task=task, backend="mock"))
        stack.enter_context(spinning(plant, fail))
        if goals:
            node = GoalNode(lambda _code: None, cli_args=arguments(goals=goals, stay=True))
            stack.enter_context(spinning(node, fail))
        stack.callback(controller.stop)
        stack.callback(plant.stop)
        until(lambda: bool(watcher.places))
        yield stranger, watcher


def speed_of(place: tuple[float, float]) -> float:
    """A speed to track in the place of a place [m/s]."""
    return 0.1 + 0.2 * place[1]


def message_of(topic: str, place: tuple[float, float]) -> Any:
    """A goal without a stamp, as a plain node sends it."""
    if topic == GOAL_POSES.name:
        path = goal_message(goal_at((*place, 0.0)), "goal_path", 0)
        return PoseArray(header=path.header, poses=[stamped.pose for stamped in path.poses])
    values = (speed_of(place), 0.0, 0.0) if topic == "goal_velocity" else (*place, np.pi / 2)
    return goal_message(goal_at(values), topic, 0)


@pytest.mark.parametrize(
    ("task", "topic", "kind"),
    [
        ("go_to_pose", "goal_pose", PoseStamped),
        ("go_to_position", "goal_point", PointStamped),
        ("go_through_positions", "goal_path", Path),
        ("go_through_positions", "goal_poses", PoseArray),
        ("track_velocities", "goal_velocity", TwistStamped),
    ],
)
def test_a_goal_of_a_plain_publisher_is_obeyed_be_it_volatile_or_latched(
    ros_domain: RosDomain, task: str, topic: str, kind: type
) -> None:
    wire = GOAL_POSES if topic == GOAL_POSES.name else GOAL_WIRES[topic]
    with system(task) as (stranger, watcher):
        for qos, place in ((10, FIRST), (publisher_qos(wire), SECOND)):  # 10: default, so volatile
            publisher = stranger.create_publisher(kind, topic, qos)
            until(lambda publisher=publisher: publisher.get_subscription_count() > 0)
            time.sleep(0.1)  # a match is seen here a moment before the other side is ready
            publisher.publish(message_of(topic, place))
            if topic == "goal_velocity":
                until(lambda place=place: abs(watcher.speed - speed_of(place)) < 0.03)
            else:
                until(lambda place=place: watcher.was_at(place))
            stranger.destroy_publisher(publisher)


def test_an_e_stop_holds_a_lock_stepped_robot_whose_goals_are_streamed_and_time_goes_on(
    ros_domain: RosDomain, tmp_path
) -> None:
    goals = tmp_path / "there_and_back.yaml"
    goals.write_text(f"kind: positions\ntitle: there and back\npositions: {[[5.0, 0.0], [0.0, 0.0]] * 50}\n")
    with system("go_to_position", str(goals)) as (stranger, watcher):
        until(lambda: watcher.was_at(FIRST))
        publisher = stranger.create_publisher(Bool, ESTOP.name, 10)
        until(lambda: publisher.get_subscription_count() >= 2)
        time.sleep(0.1)
        publisher.publish(Bool(data=True))
        until(lambda: watcher.places[-50:-1] == watcher.places[-49:])  # 50 states in one place
        steps = len(watcher.places)
        until(lambda: len(watcher.places) > steps + 50)
        assert watcher.places[-1] == watcher.places[steps]
