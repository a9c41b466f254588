"""Single nodes against hand-made neighbours: each gate refuses what it must, and says so."""

from __future__ import annotations

import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Odometry
from rclpy.lifecycle import TransitionCallbackReturn
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import JointState

from fulmar_core.backend import Sample
from fulmar_core.controllers.lqr import Lqr
from fulmar_core.robot import Robot, load_robot
from fulmar_core.state import planar_pose, planar_state
from fulmar_core.tasks.go_to_pose import GoToPose
from fulmar_core.topics import (
    ACTUATORS_STATE,
    COMMAND,
    DIAGNOSTICS,
    GOAL_POSE,
    IMU,
    ODOMETRY,
    STATUS,
    TRUTH,
)
from fulmar_ros.controller_node import ControllerNode
from fulmar_ros.controller_settings import ControllerSettings
from fulmar_ros.convert import OdometryWriter, VectorWriter, goal_message
from fulmar_ros.plant_node import PlantNode
from fulmar_ros.qos import publisher_qos, subscriber_qos
from fulmar_ros.runtime import spinning
from policy_server.lqr_node import make_lqr
from sim_nodes.mock_backend import MockBackend
from sim_nodes.sim_node import make_backend
from tests.conftest import RosDomain

NAMESPACE = "/floating_platform"


class Neighbour:
    """Another node: publishes by hand, and keeps what it hears."""

    def __init__(self) -> None:
        self.node = Node("neighbour", namespace=NAMESPACE)
        self.robot = load_robot("floating_platform")
        self.applied: list[np.ndarray] = []
        self.commands: list[np.ndarray] = []
        self.said: dict[str, tuple[str, dict[str, str]]] = {}
        listen, many = self.node.create_subscription, {"reliable": True, "depth": 50}
        listen(
            JointState,
            ACTUATORS_STATE.name,
            self._applied,
            subscriber_qos(ACTUATORS_STATE, **many),
        )
        listen(JointState, COMMAND.name, self._commanded, subscriber_qos(COMMAND, **many))
        listen(
            DiagnosticArray,
            DIAGNOSTICS.name,
            self._hear,
            subscriber_qos(DIAGNOSTICS, **many),
        )
        self._command = self.node.create_publisher(JointState, COMMAND.name, publisher_qos(COMMAND))
        self._odometry = self.node.create_publisher(Odometry, ODOMETRY.name, publisher_qos(ODOMETRY))
        self.goal_publisher = self.node.create_publisher(
            PoseStamped, GOAL_POSE.name, publisher_qos(GOAL_POSE)
        )

    def _applied(self, message: JointState) -> None:
        self.applied.append(np.array(message.effort))

    def _commanded(self, message: JointState) -> None:
        self.commands.append(np.array(message.effort))

    def _hear(self, message: DiagnosticArray) -> None:
        for status in message.status:
            self.said[status.name.split(": ")[1]] = (
                status.message,
                {pair.key: pair.value for pair in status.values},
            )

    def command(self, values: list[float], names: list[str] | None = None) -> None:
        """Send one command."""
        self._command.publish(VectorWriter(names or self.robot.actuators.names).write(np.array(values), 0))

    def give_goal(self) -> None:
        """Ask for a pose far away, so that valves open."""
        self.goal_publisher.publish(goal_message(planar_pose(4.0, 0.0, 0.0), "goal_pose", 1))

    def odometry(
        self, stamp_ns: int, spoil: Callable[[Odometry], None] = lambda _message: None, x: float = 0.0
    ) -> None:
        """Send one measurement, spoilt if asked."""
        message = OdometryWriter(self.robot.sensors.odometry).write(planar_state(x, 0.0, 0.0), stamp_ns)
        spoil(message)
        self._odometry.publish(message)


@pytest.fixture
def neighbour(ros_domain: RosDomain) -> Iterator[Neighbour]:
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
    other = Neighbour()
    with spinning(other.node, lambda error: pytest.fail(repr(error))):
        yield other
    rclpy.try_shutdown()


@pytest.fixture
def plant(neighbour: Neighbour) -> Iterator[PlantNode]:
    """A real-time plant on the mock backend."""
    arguments = ["--ros-args", "-r", f"__ns:={NAMESPACE}", "-p", "backend:=mock"]
    node = PlantNode(make_backend, lambda _code: None, cli_args=arguments)
    with spinning(node, lambda error: pytest.fail(repr(error))):
        until(lambda: bool(neighbour.applied))
        yield node
        node.stop()


@pytest.fixture
def controller(neighbour: Neighbour, monkeypatch: pytest.MonkeyPatch) -> Iterator[ControllerNode]:
    """A real-time LQR node at 50 Hz."""
    monkeypatch.setattr(sys, "argv", ["lqr_node"])
    arguments = ["--ros-args", "-r", f"__ns:={NAMESPACE}", "-p", "control_hz:=50.0"]
    node = ControllerNode(make_lqr, lambda _code: None, cli_args=arguments)
    with spinning(node, lambda error: pytest.fail(repr(error))):
        neighbour.give_goal()
        until(lambda: "controller" in neighbour.said)
        yield node
        node.stop()


def until(condition: Callable[[], bool], timeout_s: float = 8.0) -> None:
    """Wait for something."""
    end = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < end, "it did not happen in time"
        time.sleep(0.01)


def open_valves(robot: Robot) -> list[float]:
    return [1.0] + [0.0] * (len(robot.actuators.names) - 1)


def test_a_command_opens_valves_and_silence_closes_them_within_the_timeout(
    neighbour: Neighbour, plant: PlantNode
) -> None:
    """The watchdog of 0.4 s at 5 Hz, seen from outside."""
    until(lambda: neighbour.command(open_valves(neighbour.robot)) or neighbour.applied[-1].any())
    silent_since = time.monotonic()
    until(lambda: not neighbour.applied[-1].any())
    assert 0.3 < time.monotonic() - silent_since < 0.6
    until(lambda: "no command for" in neighbour.said["plant"][0])


@pytest.mark.parametrize(
    ("values", "names", "reason"),
    [
        ([float("nan")] + [1.0] * 7, None, "not finite"),
        ([1.0] * 7, [f"thruster_{i}" for i in range(1, 8)], "names 7 actuators"),
        ([1.0] * 8, [f"thruster_{i}" for i in (2, 1, 3, 4, 5, 6, 7, 8)], "'thruster_2' as actuator 1"),
    ],
)
def test_a_senseless_command_is_refused_and_named(
    values: list[float], names: list[str] | None, reason: str, neighbour: Neighbour, plant: PlantNode
) -> None:
    """The valves stay closed, and the diagnostics say why."""
    until(lambda: neighbour.command(values, names) or reason in neighbour.said.get("plant", ("",))[0])
    assert not any(applied.any() for applied in neighbour.applied)


class Stream:
    """Odometry at 50 Hz from a thread, until told otherwise."""

    def __init__(self, neighbour: Neighbour) -> None:
        self.neighbour, self.spoil, self.step_ns, self.moving = (
            neighbour,
            lambda _message: None,
            20_000_000,
            True,
        )
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _run(self) -> None:
        stamp, count = 1_000_000_000, 0
        while not self._stop.wait(0.02):
            stamp, count = stamp + self.step_ns, count + int(self.moving)
            self.neighbour.odometry(stamp, self.spoil, x=1e-6 * count)

    def stop(self) -> None:
        """Fall silent."""
        self._stop.set()
        self._thread.join()


@pytest.fixture
def stream(neighbour: Neighbour, controller: ControllerNode) -> Iterator[Stream]:
    """Good odometry, with the controller acting on it."""
    odometry = Stream(neighbour)
    until(lambda: bool(neighbour.commands) and neighbour.commands[-1].any())
    yield odometry
    odometry.stop()


def spoil_value(message: Odometry) -> None:
    message.pose.pose.position.x = float("nan")


def spoil_frame(message: Odometry) -> None:
    message.header.frame_id = "map"


def spoil_quaternion(message: Odometry) -> None:
    message.pose.pose.orientation.w = 2.0


def spoil_speed(message: Odometry) -> None:
    message.twist.twist.linear.x = 50.0


@pytest.mark.parametrize(
    ("spoil", "reason"),
    [
        (spoil_value, "not finite"),
        (spoil_frame, "must be 'odom'"),
        (spoil_quaternion, "norm"),
        (spoil_speed, "beyond the possible"),
    ],
)
def test_unbelievable_odometry_gets_closed_valves_and_a_reason(
    spoil: Callable[[Odometry], None], reason: str, stream: Stream
) -> None:
    """Each fault alone, after a good start."""
    stream.spoil = spoil
    until(lambda: reason in stream.neighbour.said["controller"][1]["reason"])
    until(lambda: not stream.neighbour.commands[-1].any())


def test_a_frozen_sensor_is_noticed(stream: Stream) -> None:
    """Stamps go on, the pose does not move by a micrometre."""
    stream.moving = False
    until(lambda: "stuck" in stream.neighbour.said["controller"][1]["reason"])
    until(lambda: not stream.neighbour.commands[-1].any())


def test_a_stamp_that_goes_back_is_refused(stream: Stream) -> None:
    """Reordered or replayed measurements do not move the robot."""
    stream.step_ns = -20_000_000
    until(lambda: "went back" in stream.neighbour.said["controller"][1]["reason"])
    until(lambda: not stream.neighbour.commands[-1].any())


def test_silence_of_the_odometry_closes_the_valves(stream: Stream) -> None:
    """At 50 Hz within 0.2 s and a period."""
    stream.stop()
    since = time.monotonic()
    until(lambda: not stream.neighbour.commands[-1].any())
    assert time.monotonic() - since < 0.4
    until(lambda: "no usable odom" in stream.neighbour.said["controller"][1]["reason"])


def test_a_controller_hears_odometry_and_its_goal_and_never_the_truth(
    neighbour: Neighbour, controller: ControllerNode
) -> None:
    """What a deployed controller may know."""
    heard = {subscription.topic_name for subscription in controller.subscriptions}
    assert heard == {f"{NAMESPACE}/{ODOMETRY.name}", f"{NAMESPACE}/{GOAL_POSE.name}"}
    assert f"{NAMESPACE}/{TRUTH.name}" not in heard
    assert {STATUS.name, IMU.name}.isdisjoint(heard)


@pytest.mark.parametrize(
    ("module", "parameter", "words"),
    [
        ("sim_nodes.sim_node", "robot:='floating_plaform'", "Did you mean 'floating_platform'?"),
        ("sim_nodes.sim_node", "backend:='mujocco'", "Did you mean 'mujoco'?"),
        ("policy_server.policy_node", "policy:='nowhere'", "policy 'nowhere' has no passport.json"),
        ("policy_server.policy_node", "control_hz:=10.0", "was trained at 5 Hz, but would run at 10 Hz"),
        ("policy_server.lqr_node", "rate:=-1.0", "must be a finite number, at least 0"),
    ],
)
def test_a_wrong_parameter_ends_a_node_with_one_line_and_exit_code_two(
    module: str, parameter: str, words: str, ros_domain: RosDomain, tmp_path: Path
) -> None:
    """Fail closed, before anything moves."""
    done = subprocess.run(
        [sys.executable, "-m", module, "--ros-args", "-r", f"__ns:={NAMESPACE}", "-p", parameter],
        env=ros_domain.env,
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=30.0,
        check=False,
    )
    assert done.returncode == 2, done.stderr
    assert words in done.stderr
    assert "Traceback" not in done.stderr


def test_a_stale_command_does_not_survive_a_deactivation(neighbour: Neighbour, plant: PlantNode) -> None:
    """Deactivate with an open valve, activate again at once: the plant begins with closed valves."""
    until(lambda: neighbour.command(open_valves(neighbour.robot)) or neighbour.applied[-1].any())
    assert plant.trigger_deactivate() == plant.trigger_activate()
    until(lambda: not neighbour.applied[-1].any())
    before = len(neighbour.applied)
    until(lambda: len(neighbour.applied) > before + 10)
    assert not any(applied.any() for applied in neighbour.applied[before:])
    assert plant.guard.watchdog.trips == 0


def test_shutdown_from_active_stops_the_loop_and_closes_the_valves(
    neighbour: Neighbour, plant: PlantNode
) -> None:
    """A finalized plant moves nothing any more."""
    until(lambda: neighbour.command(open_valves(neighbour.robot)) or neighbour.applied[-1].any())
    plant.trigger_shutdown()
    until(lambda: not neighbour.applied[-1].any())
    time.sleep(0.2)
    count = len(neighbour.applied)
    time.sleep(0.2)
    assert len(neighbour.applied) == count


def test_a_backend_that_raises_ends_the_process_with_closed_valves(neighbour: Neighbour) -> None:
    """Even if it raises again when it shall be made safe."""

    class Broken(MockBackend):
        def step(self, command: np.ndarray, ticks: int = 1) -> Sample:
            raise OSError("the bus is gone")

        def make_safe(self) -> None:
            raise OSError("still gone")

    codes: list[int] = []
    arguments = ["--ros-args", "-r", f"__ns:={NAMESPACE}"]
    node = PlantNode(lambda robot, _settings: Broken(robot), codes.append, cli_args=arguments)
    with spinning(node, lambda error: pytest.fail(repr(error))):
        until(lambda: codes == [1])
        until(lambda: "the bus is gone" in neighbour.said.get("plant", ("",))[0])


def test_a_backend_that_hangs_is_reported_and_its_watchdog_counts(neighbour: Neighbour) -> None:
    """A step that does not come back cannot hide behind an old status."""
    release = threading.Event()

    class Hanging(MockBackend):
        def step(self, command: np.ndarray, ticks: int = 1) -> Sample:
            release.wait()
            return super().step(command, ticks)

    arguments = ["--ros-args", "-r", f"__ns:={NAMESPACE}"]
    node = PlantNode(lambda robot, _settings: Hanging(robot), lambda _code: None, cli_args=arguments)
    with spinning(node, lambda error: pytest.fail(repr(error))):
        until(lambda: "it hangs" in neighbour.said.get("plant", ("",))[0])
        release.set()
        node.stop()


def test_a_controller_that_raises_commands_what_is_safe_and_ends(
    neighbour: Neighbour, ros_domain: RosDomain
) -> None:
    """The robot does not wait for the watchdog."""

    class Raising(Lqr):
        def act(self, observation: np.ndarray) -> np.ndarray:
            if np.any(observation):
                raise ZeroDivisionError("no gain today")
            return super().act(observation)

    def make(robot: Robot, task: GoToPose, settings: ControllerSettings) -> Lqr:
        good = make_lqr(robot, task, settings)
        good.__class__ = Raising
        return good

    codes: list[int] = []
    arguments = ["--ros-args", "-r", f"__ns:={NAMESPACE}", "-p", "control_hz:=50.0"]
    node = ControllerNode(make, codes.append, cli_args=arguments)
    with spinning(node, lambda error: pytest.fail(repr(error))):
        neighbour.give_goal()
        odometry = Stream(neighbour)
        until(lambda: codes != [])
        odometry.stop()
        assert set(codes) == {1}
        until(lambda: "no gain today" in neighbour.said["controller"][1]["reason"])
        assert not any(command.any() for command in neighbour.commands)
        node.stop()


def test_a_goal_beyond_the_geofence_opens_no_valve(stream: Stream) -> None:
    """Judged at once, not at the next measurement."""
    neighbour = stream.neighbour
    neighbour.goal_publisher.publish(goal_message(planar_pose(300.0, 0.0, 0.0), "goal_pose", 2))
    until(lambda: "geofence" in neighbour.said["controller"][1]["reason"])
    until(lambda: not neighbour.commands[-1].any())


def test_deactivation_ends_with_the_safe_command(stream: Stream, controller: ControllerNode) -> None:
    """Then silence."""
    controller.trigger_deactivate()
    until(lambda: not stream.neighbour.commands[-1].any())
    count = len(stream.neighbour.commands)
    time.sleep(0.2)
    assert len(stream.neighbour.commands) == count


@pytest.mark.parametrize("part", ["plant", "controller"])
def test_a_node_survives_its_whole_lifecycle_twice(
    part: str, request: pytest.FixtureRequest, neighbour: Neighbour
) -> None:
    """Clean up leaves nothing behind, and a second configuration works like the first."""
    node = request.getfixturevalue(part)
    for transition in ("deactivate", "cleanup"):
        assert getattr(node, f"trigger_{transition}")() == TransitionCallbackReturn.SUCCESS
    topics = {COMMAND.name, ODOMETRY.name}
    ours = [
        publisher.topic_name for publisher in node.publishers if publisher.topic_name.endswith(tuple(topics))
    ]
    assert not ours
    for transition in ("configure", "activate"):
        assert getattr(node, f"trigger_{transition}")() == TransitionCallbackReturn.SUCCESS
    heard = len(neighbour.applied) if part == "plant" else len(neighbour.commands)
    until(lambda: (len(neighbour.applied) if part == "plant" else len(neighbour.commands)) > heard)
