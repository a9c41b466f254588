"""The e-stop on the wires: pressed, silent, reset; and what plant and controller do about it."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
import rclpy
from rclpy.duration import Duration
from rclpy.qos import QoSProfile, ReliabilityPolicy
from std_msgs.msg import Bool, Int8
from std_srvs.srv import Trigger

from fulmar_bringup import robot_operator
from fulmar_bringup.estop_robots import Stopped, release_without_node, stop_robots
from fulmar_bringup.robot_operator import running_robots, unfit_publishers
from fulmar_cli.commands.estop import estop
from fulmar_core.config.errors import RunFailed
from fulmar_core.robots.topics import ESTOP, ESTOP_RESET, ESTOP_TRIGGER, RELAY
from fulmar_ros.estop_node import EstopNode
from fulmar_ros.plant_node import PlantNode
from fulmar_ros.qos import publisher_qos, subscriber_qos
from fulmar_ros.relay import Relay
from fulmar_ros.runtime import spinning
from tests.conftest import RosDomain
from tests.ros.cli import fulmar
from tests.ros.neighbour import NAMESPACE, ROBOT, Neighbour, Stream, open_valves, until

real_time = pytest.mark.real_time


@pytest.fixture
def button(neighbour: Neighbour) -> Iterator[EstopNode]:
    node = EstopNode(lambda _code: None, cli_args=["--ros-args", "-r", f"__ns:={NAMESPACE}"])
    with spinning(node, lambda error: pytest.fail(repr(error))):
        yield node
        node.stop()


def ask(neighbour: Neighbour, service: str) -> Trigger.Response:
    client = neighbour.node.create_client(Trigger, service)
    assert client.wait_for_service(8.0)
    future = client.call_async(Trigger.Request())
    until(future.done)
    return future.result()


def drive(neighbour: Neighbour) -> bool:
    neighbour.command(open_valves(neighbour.robot))
    return bool(neighbour.applied[-1].any())


@real_time
def test_a_trigger_closes_the_valves_while_commands_go_on(
    neighbour: Neighbour, plant: PlantNode, button: EstopNode
) -> None:
    until(lambda: drive(neighbour))
    assert ask(neighbour, ESTOP_TRIGGER).success
    until(lambda: not drive(neighbour))
    for _ in range(30):
        time.sleep(0.02)
        assert not drive(neighbour)
    until(lambda: "e-stop: pressed" in neighbour.said["plant"][0])


@real_time
def test_an_e_stop_says_nothing_before_it_can_go_on_saying_it(neighbour: Neighbour) -> None:
    """A word from a node that is still starting would be followed by silence, which takes goals away."""
    received: list[bool] = []
    neighbour.node.create_subscription(
        Bool, ESTOP.name, lambda message: received.append(message.data), subscriber_qos(ESTOP, reliable=True)
    )
    node = EstopNode(lambda _code: None, cli_args=["--ros-args", "-r", f"__ns:={NAMESPACE}"])
    until(lambda: neighbour.node.count_publishers(ESTOP.name) == 1)
    time.sleep(0.3)
    assert not received
    with spinning(node, lambda error: pytest.fail(repr(error))):
        until(lambda: received == [False] * len(received) and len(received) > 3)
        node.stop()


@real_time
def test_a_reset_is_refused_while_commands_are_not_zero_and_done_when_they_are(
    neighbour: Neighbour, plant: PlantNode, button: EstopNode
) -> None:
    until(lambda: drive(neighbour))
    ask(neighbour, ESTOP_TRIGGER)
    drive(neighbour)
    time.sleep(0.1)
    refused = ask(neighbour, ESTOP_RESET)
    assert not refused.success
    assert "not zero" in refused.message
    neighbour.command([0.0] * 8)
    time.sleep(0.1)
    assert ask(neighbour, ESTOP_RESET).success
    until(lambda: drive(neighbour))


@real_time
def test_an_e_stop_whose_process_dies_stops_the_robot_by_its_silence(
    neighbour: Neighbour, plant: PlantNode
) -> None:
    """A publisher that falls silent without a last word, as one that was killed."""
    publisher = neighbour.node.create_publisher(Bool, ESTOP.name, publisher_qos(ESTOP))

    def alive() -> bool:
        publisher.publish(Bool(data=False))
        return drive(neighbour)

    until(alive)
    since = time.monotonic()
    until(lambda: not drive(neighbour))
    assert 0.3 < time.monotonic() - since < 0.8
    until(lambda: "silent" in neighbour.said["plant"][0])


def publish_once(neighbour: Neighbour, pressed: bool, qos: QoSProfile | int) -> None:
    """One message, as a plain node publishes it: matched, sent, gone."""
    publisher = neighbour.node.create_publisher(Bool, ESTOP.name, qos)
    until(lambda: publisher.get_subscription_count() >= 2)
    time.sleep(0.1)  # a match is seen here a moment before the other side is ready
    publisher.publish(Bool(data=pressed))
    publisher.wait_for_all_acked(Duration(seconds=1.0))
    time.sleep(0.05)  # best effort is acknowledged by nobody
    neighbour.node.destroy_publisher(publisher)


def closed_in_time_and_for_good(neighbour: Neighbour) -> None:
    """Valves close within the watchdog time, and stay closed while commands go on."""
    since = time.monotonic()
    until(lambda: not drive(neighbour))
    assert time.monotonic() - since < 0.4
    for _ in range(30):  # longer than the e-stop's timeout of 0.5 s
        time.sleep(0.02)
        assert not drive(neighbour)


BEST_EFFORT = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)  # as micro-ROS publishes
DEFAULT_QOS = 10  # what rclpy makes of a depth: reliable, volatile


@real_time
@pytest.mark.parametrize("qos", [BEST_EFFORT, pytest.param(publisher_qos(ESTOP), marks=pytest.mark.slow)])
def test_one_message_of_any_publisher_stops_the_robot_until_its_node_is_reset(
    neighbour: Neighbour, plant: PlantNode, button: EstopNode, qos: QoSProfile
) -> None:
    """Another test has default settings, and a robot without a node; each comes once whatever it is offered with."""
    said: list[bool] = []
    neighbour.node.create_subscription(
        Bool, ESTOP.name, lambda message: said.append(message.data), subscriber_qos(ESTOP, reliable=True)
    )
    until(lambda: drive(neighbour) and False in said)
    publish_once(neighbour, True, qos)
    closed_in_time_and_for_good(neighbour)
    assert said[-3:] == [True] * 3  # the node holds the press too
    neighbour.command([0.0] * 8)
    time.sleep(0.1)
    assert ask(neighbour, ESTOP_RESET).success
    until(lambda: drive(neighbour))
    time.sleep(0.3)
    assert said[-2:] == [False] * 2  # its own last "pressed" does not press it again


@real_time
@pytest.mark.parametrize("latched", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_one_message_stops_a_robot_without_an_e_stop_node_until_a_reset(
    neighbour: Neighbour, plant: PlantNode, latched: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("fulmar_bringup.estop_robots.WATCH_S", 0.6)
    until(lambda: drive(neighbour))
    publish_once(neighbour, True, publisher_qos(ESTOP) if latched else DEFAULT_QOS)
    closed_in_time_and_for_good(neighbour)
    publish_once(neighbour, False, DEFAULT_QOS)
    moving = threading.Event()
    driver = threading.Thread(
        target=lambda: [drive(neighbour) for _ in iter(lambda: moving.wait(0.02), True)]
    )
    driver.start()
    assert "not zero" in release_without_node(neighbour.node, NAMESPACE)[1]
    moving.set()
    driver.join()
    neighbour.command([0.0] * 8)
    time.sleep(0.2)
    assert not neighbour.applied[-1].any()
    assert release_without_node(neighbour.node, NAMESPACE)[0]
    until(lambda: drive(neighbour))
    time.sleep(0.8)
    until(lambda: drive(neighbour))  # the two messages did not make the plant wait for a node


@real_time
def test_a_press_that_only_another_node_received_stops_the_robot(
    neighbour: Neighbour, plant: PlantNode
) -> None:
    relay = Relay(neighbour.node)
    until(lambda: drive(neighbour) and neighbour.node.count_subscribers(f"{NAMESPACE}/{RELAY.name}") > 0)
    time.sleep(0.3)
    until(lambda: drive(neighbour))
    now_ns = time.time_ns()
    info = {"source_timestamp": now_ns, "publication_sequence_number": 1, "received_timestamp": now_ns}
    relay.send(ESTOP, Bool(data=True), info)
    closed_in_time_and_for_good(neighbour)
    assert "pressed" in neighbour.said["plant"][0]


@real_time
def test_a_press_outlives_the_process_of_its_button(neighbour: Neighbour, plant: PlantNode) -> None:
    """Pressed, killed, started anew: nothing moves before a reset."""
    publisher = neighbour.node.create_publisher(Bool, ESTOP.name, publisher_qos(ESTOP))
    until(lambda: drive(neighbour))
    until(lambda: publisher.publish(Bool(data=True)) or "pressed" in neighbour.said.get("plant", ("",))[0])
    until(lambda: not drive(neighbour))
    neighbour.node.destroy_publisher(publisher)
    arguments = ["--ros-args", "-r", f"__ns:={NAMESPACE}"]
    node = EstopNode(lambda _code: None, cli_args=arguments)
    with spinning(node, lambda error: pytest.fail(repr(error))):
        for _ in range(30):
            time.sleep(0.02)
            assert not drive(neighbour)
        neighbour.command([0.0] * 8)
        time.sleep(0.1)
        assert ask(neighbour, ESTOP_RESET).success
        until(lambda: drive(neighbour))
        node.stop()


@real_time
def test_a_controller_forgets_its_goal_so_that_nothing_moves_by_itself_after_a_reset(
    stream: Stream, button: EstopNode
) -> None:
    neighbour = stream.neighbour
    until(lambda: neighbour.commands[-1].any())
    ask(neighbour, ESTOP_TRIGGER)
    until(lambda: not neighbour.commands[-1].any())
    until(lambda: "e-stop" in neighbour.said["controller"][1]["reason"])
    time.sleep(0.6)
    until(lambda: ask(neighbour, ESTOP_RESET).success)
    until(lambda: "no goal yet" in neighbour.said["controller"][1]["reason"])
    assert not neighbour.commands[-1].any()
    neighbour.repeat_goal()  # as a publisher does for a subscriber that comes late
    until(lambda: "e-stop stopped this goal" in neighbour.said["controller"][1]["goal_refused"])
    assert not neighbour.commands[-1].any()
    neighbour.give_goal()
    until(lambda: neighbour.commands[-1].any())


@real_time
def test_the_command_resets_a_robot_that_was_stopped(
    neighbour: Neighbour, plant: PlantNode, button: EstopNode, ros_domain: RosDomain, tmp_path: Path
) -> None:
    until(lambda: drive(neighbour))
    (stopped,) = stop_robots(neighbour.node, None, find_s=5.0)
    assert stopped.reached and stopped.answer == (True, "pressed: every actuator goes to its safe state")
    until(lambda: not drive(neighbour))
    neighbour.command([0.0] * 8)
    time.sleep(0.1)
    done = fulmar("estop", "floating_platform", "--reset", env=ros_domain.env, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    until(lambda: drive(neighbour))


@real_time
def test_a_robot_that_has_no_e_stop_node_is_stopped_too(
    neighbour: Neighbour, plant: PlantNode, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("fulmar_bringup.estop_robots.MISS_S", 0.5)
    until(lambda: drive(neighbour))
    assert stop_robots(neighbour.node, ROBOT, find_s=5.0) == [Stopped(NAMESPACE, reached=True, answer=None)]
    until(lambda: not drive(neighbour))
    time.sleep(0.6)
    assert not drive(neighbour)


@real_time
def test_an_e_stop_node_that_hangs_keeps_neither_its_robot_nor_another_from_being_stopped(
    neighbour: Neighbour, plant: PlantNode, ros_domain: RosDomain, tmp_path: Path
) -> None:
    """The node of a robot whose name comes first, and that of the robot itself, are stopped processes."""
    nodes = [
        subprocess.Popen(
            [sys.executable, "-m", "fulmar_ros.estop_node", "--ros-args", "-r", f"__ns:=/{name}"],
            env=ros_domain.env,
        )
        for name in ("a_robot", "floating_platform")
    ]
    try:
        for name in ("a_robot", "floating_platform"):
            assert neighbour.node.create_client(Trigger, f"/{name}/{ESTOP_TRIGGER}").wait_for_service(8.0)
        until(lambda: drive(neighbour))
        for node in nodes:
            node.send_signal(signal.SIGSTOP)
        done = fulmar("estop", "--json", env=ros_domain.env, cwd=tmp_path)
        assert done.stdout.startswith("{"), done
        said = {answer["robot"]: answer for answer in json.loads(done.stdout)["robots"]}
        assert said["floating_platform"]["done"], said
        assert "no e-stop node answers" in said["floating_platform"]["said"]
        assert not said["a_robot"]["done"]  # it has no plant that could receive
        assert done.returncode == 1
        assert "Traceback" not in done.stderr
        until(lambda: not drive(neighbour) and "e-stop: pressed" in neighbour.said["plant"][0])
        for node in nodes:
            node.send_signal(signal.SIGCONT)
        for _ in range(30):  # they still publish "released", 20 times a second
            time.sleep(0.02)
            assert not drive(neighbour)
    finally:
        for node in nodes:
            node.kill()
            node.wait()


def test_where_nobody_is_received_the_command_says_what_to_do(ros_domain: RosDomain, monkeypatch) -> None:
    monkeypatch.setattr(robot_operator, "FIND_S", 0.2)
    with pytest.raises(RunFailed, match="ROS_DOMAIN_ID"):
        estop()


@real_time
def test_a_publisher_of_another_type_is_a_warning_that_names_it(
    neighbour: Neighbour, plant: PlantNode, ros_domain: RosDomain, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("fulmar_ros.graph.LOOK_S", 0.2)
    context = rclpy.Context()  # of one process: a topic has one type there
    rclpy.init(context=context, domain_id=ros_domain.id)
    panel = rclpy.create_node("panel", namespace="/desk", context=context)
    panel.create_publisher(Int8, f"{NAMESPACE}/{ESTOP.name}", 10)
    wrong_type = f"/desk/panel publishes std_msgs/msg/Int8 on {NAMESPACE}/estop, must be std_msgs/msg/Bool"

    def warned() -> bool:
        drive(neighbour)
        if "plant" not in neighbour.said:
            return False
        message, values = neighbour.said["plant"][:2]
        said = values["wire_warnings"]
        return wrong_type in said and message.startswith("/desk")

    until(warned)
    robots = running_robots(neighbour.node, find_s=0.5)
    found = unfit_publishers(neighbour.node, robots)
    assert robots == {NAMESPACE}
    assert [words.split(",")[0] for words in found] == [wrong_type.split(",")[0]]
    panel.destroy_node()
    rclpy.shutdown(context=context)
    until(lambda: drive(neighbour) and wrong_type not in neighbour.said["plant"][1]["wire_warnings"])
