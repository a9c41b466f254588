"""A plain rclpy action client drives robots by Nav2's actions: reach, cancel, preempt, refuse, abort on a fault."""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest
import rclpy
from action_msgs.msg import GoalStatus
from action_msgs.srv import CancelGoal
from geometry_msgs.msg import PoseStamped
from nav2_msgs import action as actions
from rclpy.action import ActionClient
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from std_msgs.msg import Bool

from fulmar_core.loop import action_end
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import ESTOP
from fulmar_ros.action_node import ActionNode
from fulmar_ros.controller_node import ControllerNode
from fulmar_ros.plant_node import PlantNode
from fulmar_ros.qos import publisher_qos
from fulmar_ros.runtime import spinning
from sim_nodes.sim_node import make_backend
from tests.conftest import RosDomain
from tests.ros.controllers import make_classical
from tests.ros.neighbour import until

pytestmark = pytest.mark.real_time
RATE = 4.0  # simulated seconds a wall-clock second
SECONDS = 40.0  # for a goal, by the wall clock


class Client:
    """A client of one action of a robot, with what it received."""

    def __init__(self, node: Node, action: type, name: str) -> None:
        self._action, self.feedback = action, []
        self._client = ActionClient(node, action, name)
        until(self._client.server_is_ready, 20.0)

    def send(self, **fields: Any) -> Any:
        """Send a goal; returns its handle once the server has answered."""
        goal = self._action.Goal(**fields)
        for _ in range(3):  # rclpy may miss the answer to a call from another thread than its executor's
            asked = self._client.send_goal_async(
                goal, feedback_callback=lambda message: self.feedback.append(message.feedback)
            )
            with contextlib.suppress(AssertionError):
                until(asked.done, 5.0)
                break
        assert asked.result().accepted
        return asked.result()


class System:
    """Plant, controller and action server of a robot in one process, and a client's node."""

    def __init__(self, robot: str, node: Node, plant: PlantNode, controller: ControllerNode) -> None:
        self.robot, self.node, self.plant, self.controller = robot, node, plant, controller

    def client(self, name: str, action: str) -> Client:
        return Client(self.node, getattr(actions, action), name)

    @property
    def to_pose(self) -> Client:
        return self.client("navigate_to_pose", "NavigateToPose")

    @property
    def place(self) -> list[float]:
        newest = self.controller.guard.newest
        return list(newest.state.position_in_world)


@contextlib.contextmanager
def system_of(
    robot: str, task: str, *, may_repeat: bool = True, origin: str = "", unmapped: bool = False
) -> Iterator[System]:
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)

    def arguments(**more: object) -> list[str]:
        given = (word for key, value in more.items() for word in ("-p", f"{key}:={value}"))
        return ["--ros-args", "-r", f"__ns:=/{robot}", "-p", f"robot:={robot}", "-p", f"task:={task}", *given]

    def fail(error: Exception) -> None:
        pytest.fail(repr(error))

    def end(_code: int) -> None:
        return

    with contextlib.ExitStack() as stack:
        stack.callback(rclpy.try_shutdown)
        node = Node("client", namespace=f"/{robot}")
        stack.enter_context(spinning(node, fail))
        hz = load_robot(robot).timing.control_hz
        pace = {"rate": RATE, "control_hz": hz}
        where = {"origin": origin} if origin else {}
        plant = PlantNode(make_backend, end, cli_args=arguments(backend="mock", **pace, **where))
        stack.enter_context(spinning(plant, fail))
        stack.callback(plant.stop)
        controller = ControllerNode(
            make_classical, end, cli_args=arguments(odometry_may_repeat=may_repeat, **pace)
        )
        stack.enter_context(spinning(controller, fail))
        stack.callback(controller.stop)
        server = ActionNode(end, cli_args=arguments(unmapped=unmapped))
        stack.enter_context(spinning(server, fail))
        stack.callback(server.stop)
        until(lambda: server._newest is not None, 20.0)
        yield System(robot, node, plant, controller)


@pytest.fixture
def platform(ros_domain: RosDomain) -> Iterator[System]:
    with system_of("floating_platform", "go_to_pose") as system:
        yield system


def pose(robot: str, *place: float, frame: str = "odom", yaw: float = 0.0) -> PoseStamped:
    message = PoseStamped()
    message.header.frame_id = frame
    p, q = message.pose.position, message.pose.orientation
    p.x, p.y, p.z = (*place, 0.0)[:3]
    q.z, q.w = math.sin(yaw / 2.0), math.cos(yaw / 2.0)
    return message


def outcome(handle: Any, within_s: float = SECONDS) -> tuple[int, Any]:
    """Status and result of a goal, once it has ended."""
    asked = handle.get_result_async()
    until(asked.done, within_s)
    return asked.result().status, asked.result().result


ROBOTS = [
    ("floating_platform", "go_to_pose", (0.6, 0.3)),
    ("kingfisher", "go_to_pose", (4.0, 2.0)),
    ("turtlebot2", "go_to_pose", (0.8, 0.4)),
    ("spacecraft_16", "go_to_pose_3d", (0.4, 0.3, 0.2)),
]


@pytest.mark.parametrize(("robot", "task", "place"), ROBOTS, ids=[robot for robot, _, _ in ROBOTS])
def test_a_goal_is_reached_with_feedback(
    robot: str, task: str, place: tuple[float, ...], ros_domain: RosDomain
) -> None:
    with system_of(robot, task) as system:
        client = system.to_pose
        status, result = outcome(client.send(pose=pose(robot, *place)))
        assert (status, result.error_code, result.error_msg) == (GoalStatus.STATUS_SUCCEEDED, 0, "")
        assert math.dist(system.place[: len(place)], place) < 0.6
        distances = [feedback.distance_remaining for feedback in client.feedback]
        assert len(distances) >= 5 and distances[-1] < 0.5 * distances[0]
        assert client.feedback[-1].navigation_time.sec >= 0
        assert client.feedback[-1].current_pose.header.frame_id.endswith("odom")


def test_a_cancelled_goal_ends_as_cancelled_and_the_robot_stays(platform: System) -> None:
    client = platform.to_pose
    handle = client.send(pose=pose("floating_platform", 6.0, 0.0))
    until(lambda: platform.place[0] > 0.2, SECONDS)
    answer = handle.cancel_goal_async()
    until(answer.done, 10.0)
    assert len(answer.result().goals_canceling) == 1
    status, result = outcome(handle)
    assert (status, result.error_code) == (GoalStatus.STATUS_CANCELED, 0)
    assert "stays where it is" in result.error_msg
    target = platform.controller.guard.mission._given_goal.targets[0]
    assert 0.1 < target[0] < 3.0


def test_a_goal_that_is_cancelled_twice_is_refused_the_second_time(platform: System) -> None:
    handle = platform.to_pose.send(pose=pose("floating_platform", 3.0, 0.0))
    until(handle.cancel_goal_async().done, 10.0)
    assert outcome(handle)[0] == GoalStatus.STATUS_CANCELED
    again = handle.cancel_goal_async()
    until(again.done, 10.0)
    assert again.result().return_code == CancelGoal.Response.ERROR_GOAL_TERMINATED
    assert not again.result().goals_canceling


def test_a_newer_goal_of_another_action_takes_the_place_of_the_one_before(platform: System) -> None:
    first = platform.to_pose.send(pose=pose("floating_platform", 5.0, 0.0))
    poses = [pose("floating_platform", 0.4, 0.0), pose("floating_platform", 0.4, 0.4)]
    through = platform.client("navigate_through_poses", "NavigateThroughPoses")
    second = through.send(poses=poses)
    status, result = outcome(first)
    assert (status, result.error_code) == (GoalStatus.STATUS_ABORTED, 0)
    assert result.error_msg == "a newer goal took its place"
    assert outcome(second)[0] == GoalStatus.STATUS_SUCCEEDED
    left = [feedback.number_of_poses_remaining for feedback in through.feedback]
    assert left[0] == 2 and left[-1] == 1


def test_a_path_is_followed_to_its_end(platform: System) -> None:
    client = platform.client("follow_path", "FollowPath")
    goal = client._action.Goal()
    goal.path.header.frame_id = "odom"
    corners = [(0.0, 0.0), (0.8, 0.0), (0.8, 0.8)]
    goal.path.poses = [pose("floating_platform", *place, frame="") for place in corners]
    status, result = outcome(client.send(path=goal.path))
    assert (status, result.error_code) == (GoalStatus.STATUS_SUCCEEDED, 0)
    assert math.dist(platform.place[:2], corners[-1]) < 0.2
    assert client.feedback[-1].distance_to_goal < client.feedback[0].distance_to_goal


def test_a_goal_in_map_is_where_odom_sees_it(ros_domain: RosDomain) -> None:
    with system_of("floating_platform", "go_to_pose", origin="[10.0, 5.0, 90.0]") as system:
        client, until = system.to_pose, time.monotonic() + 10.0
        goal = pose("", 10.0, 5.6, frame="map", yaw=0.5 * math.pi)
        status, result = outcome(client.send(pose=goal))
        while "is not known" in result.error_msg and time.monotonic() < until:  # the origin is under way
            status, result = outcome(client.send(pose=goal))
        assert (status, result.error_msg) == (GoalStatus.STATUS_SUCCEEDED, "")
        assert system.place[:2] == pytest.approx((0.6, 0.0), abs=0.2)
        assert client.feedback[-1].current_pose.header.frame_id == "odom"


def test_a_goal_in_a_map_that_another_node_localizes_in_is_aborted(ros_domain: RosDomain) -> None:
    with system_of("floating_platform", "go_to_pose", unmapped=True) as system:
        status, result = outcome(system.to_pose.send(pose=pose("", 1.0, 0.0, frame="map")))
        assert (status, result.error_code) == (GoalStatus.STATUS_ABORTED, action_end.TF_ERROR)
        assert "give --origin" in result.error_msg


@pytest.mark.parametrize("task", ["go_through_positions", "go_through_poses"])
def test_a_task_of_waypoints_follows_a_path_to_its_end(task: str, ros_domain: RosDomain) -> None:
    with system_of("floating_platform", task) as system:
        client = system.client("follow_path", "FollowPath")
        goal = client._action.Goal()
        goal.path.header.frame_id = "odom"
        corners = [(0.0, 0.0), (0.8, 0.0), (0.8, 0.8)]
        goal.path.poses = [pose("floating_platform", *place, frame="") for place in corners]
        status, result = outcome(client.send(path=goal.path))
        assert (status, result.error_code) == (GoalStatus.STATUS_SUCCEEDED, 0), result.error_msg
        assert math.dist(system.place[:2], corners[-1]) < 0.3
        assert outcome(system.to_pose.send(pose=pose("", 0.4, 0.4)))[0] == GoalStatus.STATUS_SUCCEEDED


REFUSED: list[tuple[str, Callable[[], PoseStamped], int, str]] = [
    (
        "frame",
        lambda: pose("", 1.0, 0.0, frame="camera"),
        action_end.TF_ERROR,
        "goal frame is 'camera', must be 'odom'",
    ),
    ("place", lambda: pose("", 5000.0, 0.0), action_end.GOAL_OUTSIDE_MAP, "5,000 m from the origin"),
    ("number", lambda: pose("", math.nan, 0.0), action_end.UNKNOWN, "not finite"),
]


def test_a_goal_that_cannot_be_is_aborted_with_its_reason_and_the_one_before_goes_on(
    platform: System,
) -> None:
    client = platform.to_pose
    good = client.send(pose=pose("floating_platform", 0.5, 0.0))
    for _, make, code, words in REFUSED:
        status, result = outcome(client.send(pose=make()))
        assert (status, result.error_code) == (GoalStatus.STATUS_ABORTED, code)
        assert words in result.error_msg and "\n" not in result.error_msg
    empty = platform.client("navigate_through_poses", "NavigateThroughPoses").send(poses=[])
    assert outcome(empty)[1].error_code == action_end.INVALID_PATH
    assert outcome(good)[0] == GoalStatus.STATUS_SUCCEEDED


def test_a_goal_beyond_the_geofence_is_aborted_by_the_word_of_the_controller(platform: System) -> None:
    status, result = outcome(platform.to_pose.send(pose=pose("floating_platform", 500.0, 0.0)))
    assert (status, result.error_code) == (GoalStatus.STATUS_ABORTED, action_end.GOAL_OUTSIDE_MAP)
    assert "beyond the geofence" in result.error_msg


def test_a_pressed_estop_aborts_the_goal(platform: System) -> None:
    estop = platform.node.create_publisher(Bool, ESTOP.name, publisher_qos(ESTOP))
    handle = platform.to_pose.send(pose=pose("floating_platform", 5.0, 0.0))
    until(lambda: estop.get_subscription_count() >= 2, 10.0)
    estop.publish(Bool(data=True))
    status, result = outcome(handle)
    assert (status, result.error_code) == (GoalStatus.STATUS_ABORTED, action_end.NO_VALID_CONTROL)
    assert result.error_msg.startswith("e-stop: pressed")


def test_a_fault_of_the_controller_aborts_the_goal(platform: System) -> None:
    handle = platform.to_pose.send(pose=pose("floating_platform", 5.0, 0.0))
    until(lambda: platform.place[0] > 0.05, SECONDS)
    platform.controller._fail("a part has failed")
    status, result = outcome(handle)
    assert (status, result.error_code) == (GoalStatus.STATUS_ABORTED, action_end.NO_VALID_CONTROL)
    assert result.error_msg == "the controller has a fault: a part has failed"


def test_a_controller_that_does_not_act_for_long_aborts_the_goal(ros_domain: RosDomain) -> None:
    with system_of("floating_platform", "go_to_pose", may_repeat=False) as system:
        until(lambda: "stuck" in system.controller.guard.flags.input_problem, 20.0)
        status, result = outcome(system.to_pose.send(pose=pose("floating_platform", 0.6, 0.3)))
    assert (status, result.error_code) == (GoalStatus.STATUS_ABORTED, action_end.NO_VALID_CONTROL)
    assert result.error_msg.startswith("the controller does not act: no usable odom")


def test_a_controller_that_reports_nothing_any_more_aborts_the_goal(platform: System) -> None:
    handle = platform.to_pose.send(pose=pose("floating_platform", 5.0, 0.0))
    platform.controller._publish_idle_status = lambda: None
    platform.controller._publish_status = lambda *_: None
    status, result = outcome(handle)
    assert (status, result.error_code) == (GoalStatus.STATUS_ABORTED, action_end.CONTROLLER_TIMED_OUT)


# Of the feedback in Nav2 1.3 for Jazzy: ROS makes them of the names and types of all fields.
HASHES = {
    "navigate_to_pose": "RIHS01_9d1f6fa2eb975ce733b419ac2e97b134d8ff92b6478b6559feed9a50bdfd82b3",
    "navigate_through_poses": "RIHS01_073962415ad2a226b3de7245b142aeb414268a4d35ef1321ff2a484e2130e2b1",
    "follow_path": "RIHS01_3f4008700ba56ac4c82b01ef2b7fdd3fc18dc194399c48e5c43ebf8008b891d5",
}


def test_the_types_on_the_wire_have_the_hashes_of_nav2s_definitions(platform: System) -> None:
    for name, expected in HASHES.items():
        topic = f"/floating_platform/{name}/_action/feedback"
        until(lambda topic=topic: bool(platform.node.get_publishers_info_by_topic(topic)), 10.0)
        (info,) = platform.node.get_publishers_info_by_topic(topic)
        assert str(info.topic_type_hash) == expected
