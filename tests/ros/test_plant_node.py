"""The plant node against a hand-made neighbour: refuses what it must, and says so."""

from __future__ import annotations

import threading
import time

import numpy as np
import pytest
from geometry_msgs.msg import TwistStamped
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from nav_msgs.msg import Odometry
from rclpy.lifecycle import LifecycleNode
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState

from fulmar_bags.message_reader import stamp_ns
from fulmar_core.robots.topics import COMMAND, ODOMETRY, SIMULATION_START_NS
from fulmar_core.safety.actuator_guard import ActuatorGuard
from fulmar_core.safety.watchdog import Watchdog
from fulmar_core.simulation.backend import Sample
from fulmar_core.wires.reading import Reading
from fulmar_ros.convert import VectorWriter
from fulmar_ros.plant_node import PlantNode
from fulmar_ros.plant_wires import PlantWires
from fulmar_ros.qos import subscriber_qos
from fulmar_ros.runtime import spinning
from sim_nodes.mock_backend import MockBackend
from sim_nodes.sim_node import make_backend
from tests.ros.neighbour import NAMESPACE, Neighbour, open_valves, until
from tests.states import planar_state

real_time = pytest.mark.real_time


@real_time
def test_a_command_opens_valves_and_silence_closes_them_within_the_timeout(
    neighbour: Neighbour, plant: PlantNode
) -> None:
    """The watchdog of 0.4 s at 5 Hz, seen from outside."""
    until(lambda: neighbour.command(open_valves(neighbour.robot)) or neighbour.applied[-1].any())
    silent_since = time.monotonic()
    until(lambda: not neighbour.applied[-1].any())
    assert 0.3 < time.monotonic() - silent_since < 0.6
    until(lambda: "no command for" in neighbour.said["plant"][0])


SENSELESS: list[tuple[list[float], list[str] | None, str]] = [
    ([float("nan")] + [1.0] * 7, None, "not finite"),
    ([1.0] * 7, [f"thruster_{i}" for i in range(1, 8)], "names 7 actuators"),
    ([1.0] * 8, [f"thruster_{i}" for i in (2, 1, 3, 4, 5, 6, 7, 8)], "'thruster_2' as actuator 1"),
]


@real_time
def test_a_senseless_command_is_refused_and_named(neighbour: Neighbour, plant: PlantNode) -> None:
    """The valves stay closed, and the diagnostics say why."""
    for values, names, reason in SENSELESS:

        def said(values=values, names=names, reason=reason) -> bool:
            neighbour.command(values, names)
            return reason in neighbour.said["plant"][0]

        until(said)
    assert not any(applied.any() for applied in neighbour.applied)


@real_time
def test_an_answer_to_an_old_observation_opens_no_valve(neighbour: Neighbour, plant: PlantNode) -> None:
    """The watchdog is 0.4 s; answers half a second old come all the time, with stamps that go on."""

    def answer(age_ns: int) -> bool:
        neighbour.command(open_valves(neighbour.robot), stamp_ns=plant.clock.now_ns - age_ns)
        time.sleep(0.02)
        return bool(neighbour.applied[-1].any())

    until(lambda: plant.clock.now_ns > SIMULATION_START_NS + 500_000_000)
    end = time.monotonic() + 0.5
    while time.monotonic() < end:
        assert not answer(500_000_000)
    until(lambda: "older than the watchdog's 400 ms" in neighbour.said["plant"][0])
    until(lambda: answer(100_000_000))


@real_time
def test_a_stale_command_does_not_survive_a_deactivation(neighbour: Neighbour, plant: PlantNode) -> None:
    """Deactivate with an open valve, activate again at once: the plant begins with closed valves."""
    until(lambda: neighbour.command(open_valves(neighbour.robot)) or neighbour.applied[-1].any())
    assert plant.trigger_deactivate() == plant.trigger_activate()
    until(lambda: not neighbour.applied[-1].any())
    before = len(neighbour.applied)
    until(lambda: len(neighbour.applied) > before + 10)
    assert not any(applied.any() for applied in neighbour.applied[before:])
    assert plant.guard.watchdog.trips == 0


def test_a_transition_that_does_not_fit_the_state_is_refused_and_the_plant_goes_on(
    neighbour: Neighbour, plant: PlantNode
) -> None:
    """By its number and by its label; one that fits is made."""
    client = neighbour.node.create_client(ChangeState, "plant/change_state")
    assert client.wait_for_service(5.0)

    def asked(**transition: object) -> bool:
        future = client.call_async(ChangeState.Request(transition=Transition(**transition)))
        until(future.done)
        return bool(future.result().success)

    assert not asked(id=Transition.TRANSITION_CONFIGURE)
    assert not asked(label="configure")
    before = len(neighbour.applied)
    until(lambda: len(neighbour.applied) > before + 5)
    assert asked(id=Transition.TRANSITION_DEACTIVATE)
    assert asked(label="cleanup")


@real_time
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


@real_time
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


@real_time
@pytest.mark.parametrize("neighbour", ["turtlebot2"], indirect=True)
def test_wheels_follow_cmd_vel_and_slow_down_within_a_second_when_it_falls_silent(
    neighbour: Neighbour,
) -> None:
    """Turtlebot2: 0.36 m/s fall by 0.9 m/s a second, after a watchdog of 0.2 s."""
    arguments = ["--ros-args", "-r", "__ns:=/turtlebot2", "-p", "robot:=turtlebot2", "-p", "backend:=mock"]
    node = PlantNode(make_backend, lambda _code: None, cli_args=arguments)

    def drive() -> None:
        message = TwistStamped()
        message.twist.linear.x, message.twist.angular.z = 0.36, -0.9
        neighbour.drive.publish(message)

    with spinning(node, lambda error: pytest.fail(repr(error))):
        until(lambda: drive() or (bool(neighbour.applied) and neighbour.applied[-1].any()))
        until(lambda: drive() or neighbour.applied[-1] == pytest.approx([0.36, -0.9]))
        silent_since, count = time.monotonic(), len(neighbour.applied)
        until(lambda: not neighbour.applied[-1].any())
        assert 0.5 < time.monotonic() - silent_since < 1.2
        speeds = np.array([speed for speed, _ in neighbour.applied[count:] if 0.0 < speed < 0.36])
        assert len(speeds) > 5
        assert np.all(np.diff(speeds) < 0.0)
        until(lambda: "no command for" in neighbour.said["plant"][0])
        node.stop()


@real_time
def test_in_real_time_the_newest_command_is_received_from_best_effort_publishers_too(
    neighbour: Neighbour, plant: PlantNode
) -> None:
    """A reader that asks for reliability holds newer commands back behind one that a network lost."""
    qos = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
    publisher = neighbour.node.create_publisher(JointState, COMMAND.name, qos)
    message = VectorWriter(neighbour.robot.actuators.names).write(np.array(open_valves(neighbour.robot)), 0)
    until(lambda: publisher.publish(message) or neighbour.applied[-1].any())


@real_time
def test_silence_after_the_last_tick_is_no_trip(neighbour: Neighbour) -> None:
    """A controller that still speaks when the plant has finished, after a pause."""
    arguments = ["--ros-args", "-r", f"__ns:={NAMESPACE}", "-p", "backend:=mock", "-p", "duration_s:=0.4"]
    node = PlantNode(make_backend, lambda _code: None, cli_args=arguments)
    with spinning(node, lambda error: pytest.fail(repr(error))):
        until(
            lambda: (
                neighbour.command(open_valves(neighbour.robot))
                or neighbour.said.get("plant", ("", {}))[1].get("mode") == "finished"
            )
        )
        time.sleep(0.6)
        for _ in range(5):
            neighbour.command(open_valves(neighbour.robot))
            time.sleep(0.02)
        assert node.guard.watchdog.trips == 0
        node.stop()


@real_time
def test_odometry_goes_on_when_somebody_sets_the_clock_back(neighbour) -> None:
    """By an hour: dropping what lies behind the newest stamp would keep a robot blind for as long.

    What comes twice, or a little late, is still dropped.
    """
    stamps: list[int] = []
    neighbour.node.create_subscription(
        Odometry,
        ODOMETRY.name,
        lambda message: stamps.append(stamp_ns(message.header.stamp)),
        subscriber_qos(ODOMETRY, reliable=True, depth=50),
    )
    node = LifecycleNode("plant", namespace=f"/{neighbour.robot.name}")
    guard = ActuatorGuard(neighbour.robot.actuators, Watchdog(200_000_000))
    wires = PlantWires(node, neighbour.robot, guard, simulated=False)
    now, hour = 1_700_000_000_000_000_000, 3_600_000_000_000
    sent = [now, now, now + 20_000_000, now + 10_000_000, now - hour, now - hour, now - hour + 20_000_000]
    try:
        until(lambda: wires.subscribers() > 0)
        time.sleep(0.3)
        for stamp in sent:
            readings = {"odometry": Reading(planar_state(0.0, 0.0, 0.0))}
            wires.publish_sample(Sample(readings, None, stamp_ns=stamp), 0)
        until(lambda: len(stamps) >= 4)
        time.sleep(0.1)
    finally:
        wires.destroy(node)
        node.destroy_node()
    assert stamps == [now, now + 20_000_000, now - hour, now - hour + 20_000_000]
