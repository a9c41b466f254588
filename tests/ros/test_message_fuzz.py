"""Any message to any handler: no crash, and never a command that the actuators should not get.

Handlers are called directly, with real messages, on real nodes: DDS would only slow the search down.
"""

from __future__ import annotations

import copy
import dataclasses
import sys
from collections.abc import Iterator
from pathlib import Path as FilePath

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PointStamped, PoseStamped, QuaternionStamped, TwistStamped
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from nav_msgs.msg import Odometry, Path
from rclpy.serialization import serialize_message
from sensor_msgs.msg import Imu, JointState, Joy
from std_msgs.msg import Bool, Float32MultiArray, Int16MultiArray, String
from visualization_msgs.msg import Marker, MarkerArray

from fulmar_bags.message_reader import goal_of
from fulmar_bags.reading_messages import reader_of
from fulmar_core.estimators.readings import READINGS
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import IMU, MOCAP, SENSOR_WIRES
from fulmar_ros.controller_node import ControllerNode
from fulmar_ros.convert import OdometryWriter
from fulmar_ros.estimator_node import EstimatorNode
from fulmar_ros.estop_node import EstopNode
from fulmar_ros.goal_node import GoalNode
from fulmar_ros.plant_node import PlantNode
from fulmar_ros.recorder_node import RecorderNode
from fulmar_ros.teleop_node import TeleopNode
from hardware_drivers.adapter_node import AdapterNode
from tests.ros.neighbour import NAMESPACE, Neighbour
from tests.states import planar_state

FUZZ = settings(
    max_examples=40,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
NAMES = load_robot("floating_platform").actuators.names
floats = st.floats(allow_nan=True, allow_infinity=True)
frames = st.sampled_from(["odom", "base_link", "map", "", "camera", "x" * 300])


def serialized(message: object) -> bytes:
    """What a subscription of bytes receives, which need not be a message."""
    return message if isinstance(message, bytes) else serialize_message(message)


@st.composite
def stamped(draw: st.DrawFn, message: object) -> object:
    message.header.frame_id = draw(frames)  # type: ignore[attr-defined]
    message.header.stamp.sec = draw(st.integers(-(2**31), 2**31 - 1))  # type: ignore[attr-defined]
    message.header.stamp.nanosec = draw(st.integers(0, 2**32 - 1))  # type: ignore[attr-defined]
    return message


def fill(draw: st.DrawFn, *parts: object) -> None:
    """Any numbers in every field of vectors, points and quaternions."""
    for part in parts:
        for name in part.get_fields_and_field_types():  # type: ignore[attr-defined]
            setattr(part, name, draw(floats | st.sampled_from([0.0, 1.0])))


@st.composite
def odometries(draw: st.DrawFn) -> Odometry:
    message = draw(stamped(Odometry()))
    message.child_frame_id = draw(frames)
    fill(draw, message.pose.pose.position, message.pose.pose.orientation)
    fill(draw, message.twist.twist.linear, message.twist.twist.angular)
    return message


@st.composite
def good_odometries(draw: st.DrawFn) -> Odometry:
    """Such as a plant sends, in an order of its own."""
    at = [draw(st.floats(-5.0, 5.0)) for _ in range(3)]
    writer = OdometryWriter(load_robot("floating_platform").sensors.odometry)
    return writer.write(planar_state(*at), draw(st.integers(1, 10**10)))


@st.composite
def poses(draw: st.DrawFn) -> PoseStamped:
    message = draw(stamped(PoseStamped()))
    fill(draw, message.pose.position, message.pose.orientation)
    return message


@st.composite
def points(draw: st.DrawFn) -> PointStamped:
    message = draw(stamped(PointStamped()))
    fill(draw, message.point)
    return message


@st.composite
def twists(draw: st.DrawFn) -> TwistStamped:
    message = draw(stamped(TwistStamped()))
    fill(draw, message.twist.linear, message.twist.angular)
    return message


@st.composite
def paths(draw: st.DrawFn) -> Path:
    message = draw(stamped(Path()))
    message.poses = draw(st.lists(poses(), max_size=3))
    return message


@st.composite
def joint_states(draw: st.DrawFn) -> JointState:
    message = draw(stamped(JointState()))
    message.name = draw(st.just(list(NAMES)) | st.lists(st.text(max_size=12), max_size=12))
    message.effort = draw(st.lists(floats, max_size=12) | st.lists(floats, min_size=8, max_size=8))
    return message


@st.composite
def markers(draw: st.DrawFn) -> MarkerArray:
    found = []
    for _ in range(draw(st.integers(0, 3))):
        marker = draw(stamped(Marker()))
        marker.action = draw(st.integers(0, 5))
        fill(draw, marker.pose.position, marker.scale)
        found.append(marker)
    return MarkerArray(markers=found)


@st.composite
def imus(draw: st.DrawFn) -> Imu:
    message = draw(stamped(Imu()))
    fill(draw, message.linear_acceleration, message.angular_velocity)
    message.linear_acceleration_covariance[0] = draw(floats)
    return message


@st.composite
def joys(draw: st.DrawFn) -> Joy:
    axes = draw(st.lists(st.floats(width=32, allow_nan=True, allow_infinity=True), max_size=10))
    return Joy(axes=axes, buttons=draw(st.lists(st.integers(-(2**31), 2**31 - 1), max_size=10)))


@given(messages=st.lists(joint_states() | twists() | st.booleans(), max_size=6), by_hand=st.booleans())
@FUZZ
def test_a_plant_applies_nothing_but_commands_within_its_limits(
    plant: PlantNode, messages: list[object], by_hand: bool
) -> None:
    wires = plant.wires
    for message in messages:
        if isinstance(message, bool):
            wires.estop._on_estop(Bool(data=message), {})
        elif by_hand and isinstance(message, JointState):
            wires.commands._on_teleop(message)
        else:
            wires.commands._on_command(serialized(message))
        with wires.lock:
            output = plant.guard.output(10**18)
            command = plant.guard.command
        assert not output.any()  # so much later it is safe, whatever came
        assert command.shape == (8,)
        assert set(command.tolist()) <= {0.0, 1.0}


@given(
    messages=st.lists(
        odometries()
        | poses()
        | points()
        | twists()
        | paths()
        | markers()
        | st.text(max_size=20)
        | st.binary(max_size=800)
        | st.booleans(),
        max_size=6,
    )
)
@FUZZ
def test_a_controller_commands_nothing_but_finite_values_within_its_limits(
    neighbour: Neighbour, controller: ControllerNode, messages: list[object]
) -> None:
    commands: list[np.ndarray] = []
    publish = controller.wires.publish_command
    controller.wires.publish_command = lambda command, stamp: (  # type: ignore[method-assign]
        commands.append(np.array(command)),
        publish(command, stamp),
    )
    try:
        for message in messages:
            if isinstance(message, Odometry | bytes):
                controller._on_odometry(serialized(message))
            elif isinstance(message, MarkerArray):
                controller._on_obstacles(message)
            elif isinstance(message, bool):
                controller._on_estop(Bool(data=message))
            elif isinstance(message, str):
                controller._on_swap(String(data=message))
            else:
                controller._on_goal(message, {})
            controller._control(controller.guard.newest)
    finally:
        controller.wires.publish_command = publish  # type: ignore[method-assign]
    for command in commands:
        assert command.shape == (8,)
        assert set(command.tolist()) <= {0.0, 1.0}


@pytest.fixture
def others(neighbour: Neighbour, monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[object, object, object]]:
    monkeypatch.setattr(sys, "argv", ["node"])
    space = ["--ros-args", "-r", f"__ns:={NAMESPACE}"]
    nodes = (
        EstimatorNode(lambda _code: None, cli_args=space),
        EstopNode(lambda _code: None, cli_args=space),
        TeleopNode(lambda _code: None, cli_args=[*space, "-p", "keyboard:=false"]),
    )
    yield nodes
    for node in nodes:
        node.destroy_node()


@given(messages=st.lists(poses() | imus() | joint_states() | twists() | joys(), max_size=8))
@FUZZ
def test_estimator_e_stop_and_teleoperation_survive_anything(
    others: tuple[EstimatorNode, EstopNode, TeleopNode], messages: list[object]
) -> None:
    estimator, estop, teleop = others
    published: list[Odometry] = []
    odom, _ = estimator._outputs[0]
    odom.publish = lambda message: published.append(copy.deepcopy(message))  # type: ignore[method-assign]
    for message in messages:
        with np.errstate(all="ignore"):
            if isinstance(message, PoseStamped):
                estimator._on_message("mocap", MOCAP.name, reader_of(READINGS["mocap"]), message)
                attitude = QuaternionStamped(header=message.header, quaternion=message.pose.orientation)
                wire = SENSOR_WIRES["star_tracker"]
                estimator._on_message(
                    "star_tracker", wire.name, reader_of(READINGS["star_tracker"]), attitude
                )
            elif isinstance(message, Imu):
                estimator._on_message("imu", IMU.name, reader_of(READINGS["imu"]), message)
            elif isinstance(message, JointState):
                estop._on_command("actuators/command", message)
            elif isinstance(message, TwistStamped):
                estop._on_velocity(message)
            else:
                teleop._on_joy(message)
        teleop._send()
        estop._publish()
    for odometry in published:
        twist = odometry.twist.twist
        assert np.isfinite([twist.linear.x, twist.linear.y, twist.angular.z]).all()


@pytest.fixture(params=["lab_pose", "circle", "velocity_steps"])
def goals(neighbour: Neighbour, request: pytest.FixtureRequest) -> Iterator[GoalNode]:
    words = ["--ros-args", "-r", f"__ns:={NAMESPACE}", "-p", f"goals:={request.param}", "-p", "stay:=true"]
    node = GoalNode(lambda _code: None, cli_args=words)
    yield node
    node.destroy_node()


@given(messages=st.lists(odometries() | good_odometries(), max_size=10), lockstep=st.booleans())
@FUZZ
def test_a_goal_node_states_nothing_but_finite_goals(
    goals: GoalNode, messages: list[Odometry], lockstep: bool
) -> None:
    reported: list[object] = []
    goals._publisher.publish = reported.append  # type: ignore[method-assign]
    goals._settings = dataclasses.replace(goals._settings, lockstep=lockstep)
    for message in messages:
        with np.errstate(all="ignore"):
            goals._on_odometry(message)
            goals._watch()
    for message in reported:
        goal, problem = goal_of(message)
        assert goal is not None, problem


ADAPTERS = {
    "zero_g_lab_valve_node": "floating_platform",
    "turtlebot2_kobuki_node": "turtlebot2",
    "kingfisher_action": "kingfisher",
}
short_integers = st.integers(-(2**15), 2**15 - 1)
arrays = {
    "zero_g_lab_valve_node": st.builds(
        Int16MultiArray,
        data=st.lists(short_integers, max_size=12) | st.lists(st.integers(0, 1), min_size=9, max_size=9),
    ),
    "turtlebot2_kobuki_node": twists().map(lambda message: message.twist),
    "kingfisher_action": st.builds(
        Float32MultiArray, data=st.lists(st.floats(width=32, allow_nan=True), max_size=4)
    ),
}


@pytest.fixture(params=list(ADAPTERS))
def adapter(neighbour: Neighbour, request: pytest.FixtureRequest) -> Iterator[tuple[str, AdapterNode]]:
    words = ["--ros-args", "-r", f"__ns:={NAMESPACE}", "-p", f"hardware:={request.param}"]
    node = AdapterNode(lambda _code: None, cli_args=words)
    yield request.param, node
    node.destroy_node()


@given(data=st.data())
@FUZZ
def test_an_adapter_passes_on_nothing_but_finite_commands_of_the_right_length(
    adapter: tuple[str, AdapterNode], data: st.DataObject
) -> None:
    hardware, node = adapter
    actuators = load_robot(ADAPTERS[hardware]).actuators
    passed: list[object] = []
    # Copies: a writer fills the same message again and again.
    node._publisher.publish = lambda message: passed.append(copy.deepcopy(message))  # type: ignore[method-assign]
    for message in data.draw(st.lists(arrays[hardware], max_size=6)):
        node._receive(message)
    for command in passed:
        if isinstance(command, TwistStamped):
            values = [command.twist.linear.x, command.twist.angular.z]
        else:
            assert tuple(command.name) == actuators.names  # type: ignore[attr-defined]
            values = list(command.effort)  # type: ignore[attr-defined]
        assert np.isfinite(values).all()
        assert len(values) == len(actuators.names)
        assert not actuators.binary or set(values) <= {0.0, 1.0}


@pytest.mark.parametrize("mode", ["whole", "ring"])
def test_a_recorder_keeps_any_bytes_and_loses_none(
    mode: str, neighbour: Neighbour, tmp_path: FilePath
) -> None:
    """Foreign bytes on every topic; the ring looks into some of them for faults."""
    words = [
        "--ros-args",
        "-r",
        f"__ns:={NAMESPACE}",
        "-p",
        f"directory:={tmp_path / 'bag'}",
        "-p",
        f"mode:={mode}",
    ]
    node = RecorderNode(lambda _code: None, cli_args=words)
    topics, count = sorted(node._topics.values()), 0
    error = bytes(serialize_message(diagnostics_of(f"{NAMESPACE[1:]}: plant", DiagnosticStatus.ERROR)))

    @given(
        st.sampled_from(topics), st.binary(max_size=200) | st.tuples(st.integers(0, 200), st.integers(0, 255))
    )
    @FUZZ
    def receive(topic: str, data: bytes | tuple[int, int]) -> None:
        nonlocal count
        if isinstance(data, tuple):  # a real one with a byte changed
            spoilt = bytearray(error)
            spoilt[data[0] % len(spoilt)] = data[1]
            data = bytes(spoilt)
        node._keep(topic)(data, {"source_timestamp": 1})
        count += 1

    receive()
    node._keep("/diagnostics")(error, {"source_timestamp": 1})
    assert node.stop() == 0
    node.destroy_node()
    with next((tmp_path / "bag").glob("*.mcap")).open("rb") as stream:
        assert make_reader(stream).get_summary().statistics.message_count >= count + 1


def diagnostics_of(name: str, level: bytes) -> DiagnosticArray:
    return DiagnosticArray(status=[DiagnosticStatus(name=name, level=level, message="x")])
