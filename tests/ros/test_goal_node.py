"""The goal node against hand-made odometry, and in a loop with a plant and a controller."""

from __future__ import annotations

import contextlib
import itertools
import math
import signal
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
import rclpy
from geometry_msgs.msg import PointStamped, PoseStamped, TwistStamped
from nav_msgs.msg import Path

from fulmar_bags.message_reader import stamp_ns
from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import GOAL_POSE, GOAL_WIRES, RELAY
from fulmar_core.tasks.goal_files import single_goal
from fulmar_ros.goal_messages import TYPES
from fulmar_ros.goal_node import GoalNode
from fulmar_ros.qos import subscriber_qos
from fulmar_ros.relay import Relay
from fulmar_ros.runtime import spinning
from tests.conftest import RosDomain
from tests.ros.cli import fulmar, start_fulmar
from tests.ros.neighbour import NAMESPACE, ROBOT, Neighbour, Stream, until

pytestmark = pytest.mark.real_time

VELOCITIES = """
kind: velocities
title: ahead, then turning
velocities:
  - { velocity: [0.3, 0.0, 0.0], hold_s: 0.4 }
  - { velocity: [0.0, 0.0, 90.0], hold_s: 0.4 }
"""
POSITIONS = """
kind: positions
title: here, then there
positions: [[1.0, 0.0], [1.0, 1.0]]
"""
LINE = """
kind: path
title: a wave ahead
path: { kind: sine, length: 4.0, amplitude: 0.1, cycles: 1 }
speed: 0.25
look_ahead: 0.2
"""
PATIENT = {"input_timeout_s": 5.0}  # a busy machine may hold up the odometry


class Ears:
    """Keeps every goal that is reported."""

    def __init__(self, neighbour: Neighbour) -> None:
        self.points: list[PointStamped] = []
        self.paths: list[Path] = []
        self.velocities: list[TwistStamped] = []
        kept: dict[str, list[Any]] = {
            "goal_point": self.points,
            "goal_path": self.paths,
            "goal_velocity": self.velocities,
        }
        for topic, messages in kept.items():
            qos = subscriber_qos(GOAL_WIRES[topic], depth=50)
            neighbour.node.create_subscription(TYPES[topic], topic, messages.append, qos)

    @property
    def moves(self) -> list[tuple[float, float, float]]:
        """Velocities as numbers."""
        twists = [message.twist for message in self.velocities]
        return [(t.linear.x, t.linear.y, t.angular.z) for t in twists]


@pytest.fixture
def ears(neighbour: Neighbour) -> Ears:
    return Ears(neighbour)


@contextlib.contextmanager
def goal_node(tmp_path, text: str, **parameters: object) -> Iterator[tuple[GoalNode, list[int]]]:
    """A goal node for a file; and the codes with which it asks to end."""
    file = tmp_path / "mine.yaml"
    file.write_text(text)
    arguments = ["--ros-args", "-r", f"__ns:={NAMESPACE}", "-p", f"goals:={file}"]
    for name, value in parameters.items():
        arguments += ["-p", f"{name}:={value}"]
    codes: list[int] = []
    node = GoalNode(codes.append, cli_args=arguments)
    with spinning(node, lambda error: pytest.fail(repr(error))):
        yield node, codes
        node.stop()


@contextlib.contextmanager
def single_goal_node(*place: float, **parameters: object) -> Iterator[tuple[GoalNode, list[int]]]:
    """A goal node for one place, as the command line gives it."""
    space = f"/{parameters.get('robot', ROBOT)}"
    arguments = ["--ros-args", "-r", f"__ns:={space}"]
    for name, value in parameters.items():
        arguments += ["-p", f"{name}:={value}"]
    codes: list[int] = []
    form = load_robot(str(parameters.get("robot", ROBOT))).state_type
    node = GoalNode(codes.append, goals=single_goal(place, form), cli_args=arguments)
    with spinning(node, lambda error: pytest.fail(repr(error))):
        yield node, codes
        node.stop()


@contextlib.contextmanager
def streaming(neighbour: Neighbour, spoil: Callable[[Any], None] = lambda _message: None) -> Iterator[Stream]:
    """Odometry at 50 Hz."""
    odometry = Stream(neighbour)
    odometry.spoil = spoil
    try:
        yield odometry
    finally:
        odometry.stop()


def test_velocities_come_by_the_odometry_s_clock_and_end_in_standstill(
    tmp_path, neighbour: Neighbour, ears: Ears
) -> None:
    """Twenty milliseconds a message, whatever the wall clock says."""
    with goal_node(tmp_path, VELOCITIES, **PATIENT) as (_, codes):
        with streaming(neighbour):
            until(lambda: codes == [0] and len(ears.moves) == 3)
        assert ears.moves == [(0.3, 0.0, 0.0), (0.0, 0.0, pytest.approx(math.pi / 2)), (0.0, 0.0, 0.0)]
        first, second, last = (stamp_ns(message.header.stamp) for message in ears.velocities)
        assert 400_000_000 <= second - first < 600_000_000
        assert 800_000_000 <= last - first < 1_000_000_000
        assert {message.header.frame_id for message in ears.velocities} == {"base_link"}


def test_a_volatile_subscriber_that_comes_late_gets_the_goal_with_its_stamp_and_disturbs_no_latched_one(
    tmp_path, neighbour: Neighbour, ears: Ears, ros_domain: RosDomain
) -> None:
    with goal_node(tmp_path, POSITIONS, stay=True, **PATIENT), streaming(neighbour):
        until(lambda: len(ears.points) == 1)
        late = rclpy.create_node("stranger", namespace=NAMESPACE)
        got: list[PointStamped] = []
        late.create_subscription(PointStamped, "goal_point", got.append, 10)
        with spinning(late, lambda error: pytest.fail(repr(error))):
            until(lambda: bool(got))
        assert got[0] == ears.points[0]
        assert ears.points[1:] == got  # what the others receive is the very same message
        time.sleep(1.2)
        assert len(ears.points) == 2  # once for each that comes


def test_positions_come_when_the_one_before_is_reached_and_each_once(
    tmp_path, neighbour: Neighbour, ears: Ears
) -> None:
    """The robot is put there by hand."""
    places = iter([(0.0, 0.0)] * 20 + [(1.0, 0.0)] * 70 + [(1.0, 1.0)] * 10_000)

    def put(message: Any) -> None:
        message.pose.pose.position.x, message.pose.pose.position.y = next(places)

    with goal_node(tmp_path, POSITIONS) as (_, codes), streaming(neighbour, put):
        until(lambda: codes == [0] and len(ears.points) == 2)
    assert [(m.point.x, m.point.y) for m in ears.points] == [(1.0, 0.0), (1.0, 1.0)]
    assert not ears.velocities


def test_as_a_path_all_positions_come_in_one_message(tmp_path, neighbour: Neighbour, ears: Ears) -> None:
    """For tasks that pass through them."""
    with goal_node(tmp_path, POSITIONS, as_path="true"), streaming(neighbour):
        until(lambda: bool(ears.paths))
    assert [(p.pose.position.x, p.pose.position.y) for p in ears.paths[0].poses] == [(1.0, 0.0), (1.0, 1.0)]


def test_along_a_path_velocities_come_at_the_rate_that_was_asked_for(
    tmp_path, neighbour: Neighbour, ears: Ears
) -> None:
    """Steered for a robot that cannot move sideways."""

    def drift(message: Any) -> None:
        message.pose.pose.position.y = 1e-10 * stamp_ns(message.header.stamp)

    with (
        goal_node(tmp_path, LINE, robot="turtlebot2", control_hz=5.0, **PATIENT),
        streaming(neighbour, drift),
    ):
        until(lambda: len(ears.velocities) >= 4)
    stamps = [stamp_ns(message.header.stamp) for message in ears.velocities[:4]]
    assert all(200_000_000 <= b - a < 400_000_000 for a, b in itertools.pairwise(stamps))
    assert all(ahead == pytest.approx(0.25) and left == 0.0 for ahead, left, _ in ears.moves[:4])


def test_silence_of_the_odometry_becomes_standstill_and_its_return_goes_on(
    tmp_path, neighbour: Neighbour, ears: Ears
) -> None:
    """The time of silence does not count."""
    with goal_node(tmp_path, VELOCITIES.replace("hold_s: 0.4", "hold_s: 30.0")) as (_, codes):
        with streaming(neighbour):
            until(lambda: len(ears.moves) == 1)
        until(lambda: len(ears.moves) == 2)
        assert not any(ears.moves[1])
        with streaming(neighbour):
            until(lambda: len(ears.moves) == 3)
        assert ears.moves[2] == ears.moves[0]
        assert not codes


def test_unbelievable_odometry_counts_as_silence(tmp_path, neighbour: Neighbour, ears: Ears) -> None:
    """As for a controller."""

    def spoil(message: Any) -> None:
        message.header.frame_id = "map"

    with (
        goal_node(tmp_path, VELOCITIES.replace("hold_s: 0.4", "hold_s: 30.0")),
        streaming(neighbour) as odometry,
    ):
        until(lambda: len(ears.moves) == 1)
        odometry.spoil = spoil
        until(lambda: len(ears.moves) == 2)
    assert not any(ears.moves[1])


def test_whoever_stops_the_node_stops_the_robot(tmp_path, neighbour: Neighbour, ears: Ears) -> None:
    """Ctrl-C in the middle of a velocity."""
    with goal_node(tmp_path, VELOCITIES.replace("hold_s: 0.4", "hold_s: 30.0")), streaming(neighbour):
        until(lambda: len(ears.moves) == 1)
    until(lambda: len(ears.moves) == 2)
    assert not any(ears.moves[1])


def test_a_file_that_is_wrong_is_named(tmp_path, ros_domain: RosDomain, neighbour: Neighbour) -> None:
    """Before anything is reported."""
    with pytest.raises(ConfigError, match=r"mine\.yaml"), goal_node(tmp_path, "kind: dances\ntitle: no\n"):
        pass
    assert rclpy.ok()


def test_without_a_robot_or_a_controller_the_node_ends_if_it_shall_not_wait(
    tmp_path, neighbour: Neighbour, ros_domain: RosDomain
) -> None:
    with (
        goal_node(tmp_path, POSITIONS, give_up_s=0.5) as (_, codes),
        goal_node(tmp_path, POSITIONS) as (_, waits),
    ):
        until(lambda: codes == [1])
    with goal_node(tmp_path, POSITIONS, give_up_s=0.5) as (node, codes), streaming(neighbour):
        assert "no controller subscribes" in node._without_subscriber()
        until(lambda: codes == [1])
    assert waits == []


def test_with_robot_and_controller_the_node_goes_on(tmp_path, neighbour: Neighbour, ears: Ears) -> None:
    with goal_node(tmp_path, POSITIONS, give_up_s=0.5, **PATIENT) as (node, codes), streaming(neighbour):
        until(lambda: node._alone_checked)
    assert codes == []


@pytest.mark.parametrize("gone", ["robot", "controller"])
def test_goals_end_with_one_line_when_their_robot_or_its_controller_went_silent(
    gone: str, tmp_path, neighbour: Neighbour, capfd
) -> None:
    topic, code = "/floating_platform/goal_point", 1
    listener = neighbour.node.create_subscription(PointStamped, topic, lambda _message: None, 10)
    with goal_node(tmp_path, POSITIONS, give_up_s=0.5, **PATIENT) as (node, codes):
        with streaming(neighbour):
            until(lambda: node._alone_checked)
            time.sleep(0.6)
            assert codes == []
            if gone == "controller":
                neighbour.node.destroy_subscription(listener)
                until(lambda: codes == [code])
        until(lambda: codes == [code])
    (line,) = [line for line in capfd.readouterr().err.splitlines() if "ERROR" in line]
    missing = {
        "robot": "the robot went silent: nothing comes on /floating_platform/odom",
        "controller": f"no controller subscribes {topic} any more",
    }
    assert f"{missing[gone]} (for 0.5 s)" in line and "fulmar goals --wait" in line


@pytest.mark.slow  # the node itself ends in half a second, above
def test_goals_for_a_robot_that_is_not_up_end_with_one_line(tmp_path, ros_domain: RosDomain) -> None:
    words = ("goals", "lab_pose", "--robot", "floating_platform")
    done = fulmar(*words, env=ros_domain.env, cwd=tmp_path, timeout_s=30.0)
    assert done.returncode == 1
    (line,) = [line for line in done.stderr.splitlines() if "ERROR" in line]
    assert "nothing comes on /floating_platform/odom (after 5 s)" in line
    assert "--wait" in line
    assert "WARN" not in done.stderr


def test_a_pose_on_the_command_line_becomes_the_goal_of_a_running_controller(
    tmp_path, neighbour: Neighbour, stream: Stream, controller: Any, ros_domain: RosDomain
) -> None:
    """And of whoever subscribes as a node does by default, with a stamp."""
    got: list[PoseStamped] = []
    neighbour.node.create_subscription(PoseStamped, "goal_pose", got.append, 10)
    words = ("goals", "--robot", "floating_platform", "--pose", "3,1,90")
    command = start_fulmar(*words, env=ros_domain.env, cwd=tmp_path)
    try:
        until(lambda: bool(np.allclose(controller.guard.loop.goal.current, [3.0, 1.0, math.pi / 2])), 20.0)
        until(
            lambda: any(stamp_ns(message.header.stamp) and message.pose.position.y == 1.0 for message in got)
        )
        command.send_signal(signal.SIGINT)
        _, said = command.communicate(timeout=20.0)
    finally:
        if command.poll() is None:
            command.kill()
    assert command.returncode == 0, said
    (line,) = [line for line in said.splitlines() if "published" in line]
    assert "x 3, y 1 m, heading 90 degrees on /floating_platform/goal_pose" in line


@pytest.mark.parametrize("controller", [["area:=[-2.0, 9.0, -2.0, 2.0]"]], indirect=True)
def test_a_pose_outside_the_area_of_the_running_controller_ends_with_one_line_and_changes_nothing(
    neighbour: Neighbour, stream: Stream, controller: Any, capfd
) -> None:
    before = controller.guard.loop.goal.current.tolist()
    with single_goal_node(1.0, 3.0, 90.0, **PATIENT) as (_, codes):
        until(lambda: codes == [1])
    (line,) = [line for line in capfd.readouterr().err.splitlines() if "ERROR" in line]
    assert (
        "refuses the goal: out of bounds: the goal x = 1 m, y = 3 m lies outside the area of x -2 to 9 m"
        in line
    )
    assert controller.guard.loop.goal.current.tolist() == before


def test_a_goal_that_only_another_node_received_is_followed(
    neighbour: Neighbour, stream: Stream, controller: Any
) -> None:
    relay, goal = Relay(neighbour.node), PoseStamped()
    goal.header.frame_id, goal.pose.position.x, goal.pose.orientation.w = "odom", 2.0, 1.0
    now_ns = time.time_ns()
    info = {"source_timestamp": now_ns, "publication_sequence_number": 1, "received_timestamp": now_ns}
    until(lambda: neighbour.node.count_subscribers(f"{NAMESPACE}/{RELAY.name}") > 0)
    time.sleep(0.3)
    relay.send(GOAL_POSE, goal, info)
    until(lambda: bool(np.allclose(controller.guard.loop.goal.current, [2.0, 0.0, 0.0])))


def test_a_pose_beyond_the_geofence_of_the_running_controller_ends_with_one_line(
    neighbour: Neighbour, stream: Stream, controller: Any, capfd
) -> None:
    with single_goal_node(100.0, 3.0, 90.0, **PATIENT) as (_, codes):
        until(lambda: codes == [1])
    said = capfd.readouterr().err
    (line,) = [line for line in said.splitlines() if "ERROR" in line]
    assert "the controller refuses the goal: goal is 100.0 m away, beyond the geofence of 8 m" in line
    assert "goal refused: goal is 100.0 m away, beyond the geofence of 8 m" in said


@pytest.mark.parametrize("neighbour", ["turtlebot2"], indirect=True)
@pytest.mark.parametrize("topic", ["goal_velocity", "goal_path"])
def test_a_pose_for_a_controller_that_takes_other_goals_ends_with_one_line(
    topic: str, neighbour: Neighbour, capfd
) -> None:
    listener = neighbour.node.create_subscription(TYPES[topic], topic, lambda _message: None, 10)
    arguments = {"robot": "turtlebot2", "give_up_s": 0.5, **PATIENT}
    with single_goal_node(1.0, 2.0, 90.0, **arguments) as (_, codes), streaming(neighbour):
        until(lambda: codes == [1])
    neighbour.node.destroy_subscription(listener)
    (line,) = [line for line in capfd.readouterr().err.splitlines() if "ERROR" in line]
    assert "no controller subscribes" in line and f"The one that runs takes {topic}: give a file of" in line


@pytest.mark.parametrize(
    ("neighbour", "place", "taken", "advice"),
    [
        ("spacecraft_16", (0.0, 0.0, 0.0), "goal_pose", "--pose x,y,z,roll,pitch,yaw or a file of poses"),
        ("spacecraft_16", (0.0,) * 6, "goal_point", "--position x,y,z or a file of positions"),
        ("floating_platform", (0.0, 0.0), "goal_pose", "--pose x,y,deg or a file of poses"),
        ("floating_platform", (0.0, 0.0, 0.0), "goal_point", "--position x,y or a file of positions"),
    ],
    indirect=["neighbour"],
)
def test_a_place_where_the_robot_is_counts_as_neither_published_nor_reached_while_nobody_takes_it(
    neighbour: Neighbour, place: tuple[float, ...], taken: str, advice: str, capfd
) -> None:
    listener = neighbour.node.create_subscription(TYPES[taken], taken, lambda _message: None, 10)
    parameters = {"robot": neighbour.robot.name, "give_up_s": 1.0, **PATIENT}
    with single_goal_node(*place, **parameters) as (_, codes), streaming(neighbour):
        until(lambda: bool(codes))
    neighbour.node.destroy_subscription(listener)
    said = capfd.readouterr().err
    assert codes == [1]
    (line,) = [line for line in said.splitlines() if "ERROR" in line]
    assert f"(after 1 s). The one that runs takes {taken}: give {advice}." in line
    assert "published" not in said and "reached" not in said


def test_goals_wait_for_a_controller_that_starts_after_them(
    tmp_path, neighbour: Neighbour, ros_domain: RosDomain
) -> None:
    """Their time begins then; a recorder does not count as a subscriber."""
    recorder = rclpy.create_node("recorder", namespace=NAMESPACE)
    recorded: list[TwistStamped] = []
    recorder.create_subscription(
        TwistStamped, "goal_velocity", recorded.append, subscriber_qos(GOAL_WIRES["goal_velocity"], depth=50)
    )
    with (
        spinning(recorder, lambda error: pytest.fail(repr(error))),
        streaming(neighbour),
        goal_node(tmp_path, VELOCITIES, **PATIENT) as (_, codes),
    ):
        time.sleep(1.5)  # longer than the velocities last
        assert (recorded, codes) == ([], [])
        ears = Ears(neighbour)
        until(lambda: codes == [0] and len(ears.moves) == 3)
        first, second, _ = (stamp_ns(message.header.stamp) for message in ears.velocities)
        assert 400_000_000 <= second - first < 600_000_000


@pytest.mark.slow
@pytest.mark.parametrize("controller", [["odometry_may_repeat:=true"]], indirect=True)  # a mock has no noise
def test_a_simulated_platform_goes_where_the_command_states_it(
    tmp_path, neighbour: Neighbour, plant: Any, controller: Any, ros_domain: RosDomain
) -> None:
    """`fulmar goals` in a process of its own, with a plant and an LQR that go to poses."""
    neighbour.withdraw_command()  # of each wire only one node may publish
    neighbour.withdraw_odometry()
    neighbour.node.destroy_publisher(neighbour.bearing)
    (tmp_path / "near.yaml").write_text("kind: poses\ntitle: near\nposes: [[0.3, 0.0, 0.0]]\n")
    command = start_fulmar(
        "goals", "near.yaml", "--robot", "floating_platform", env=ros_domain.env, cwd=tmp_path
    )
    try:
        _, words = command.communicate(timeout=60.0)
    finally:
        if command.poll() is None:
            command.kill()
    assert command.returncode == 0, words
    assert "1 of 1 targets reached" in words
