"""Node that emulates a robot's hardware: a device that speaks its protocol, and a simulator behind it.

That is MuJoCo, or, behind X-Plane, the core's own flight dynamics.
"""

from __future__ import annotations

import sys
import threading
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from geometry_msgs.msg import PoseStamped, Twist, TwistStamped
from nav_msgs.msg import Odometry
from rclpy.node import Node
from rclpy.publisher import Publisher
from sensor_msgs.msg import JointState
from std_msgs.msg import Float32MultiArray

from fulmar_core.config.errors import FAILED, ConfigError, UnknownNameError
from fulmar_core.config.process import PLANT_PRIORITY, take_priority, take_priority_with_helpers
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import DEVICE_STATE, MOCAP, ODOMETRY, TRUTH
from fulmar_core.simulation.backend import Backend, Sample
from fulmar_core.states.state import RigidBodyState
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import Scenario, load_scenario
from fulmar_ros.convert import OdometryWriter, PoseWriter, VectorWriter
from fulmar_ros.deadline import Deadlines
from fulmar_ros.foreign_topics import VALVE_MESSAGES
from fulmar_ros.motion_capture import capture_maker
from fulmar_ros.parameters import own_frames, read_parameters
from fulmar_ros.plant_settings import PlantSettings, first_episode
from fulmar_ros.px4_wires import Px4Wires
from fulmar_ros.qos import publisher_qos
from fulmar_ros.runtime import RequestExit, run_node, settle_memory
from sim_nodes.emulators.device import EmulatedDevice, Link, PtyLink, TcpLink
from sim_nodes.emulators.kingfisher import KingfisherEmulator
from sim_nodes.emulators.kobuki import KobukiEmulator
from sim_nodes.emulators.outputs import BASE_TIMEOUT_S, NO_TIMEOUT_S, TopicDevice, ValveBank, ValveNode
from sim_nodes.emulators.pwm import PwmBank
from sim_nodes.emulators.px4 import Px4Emulator
from sim_nodes.emulators.wiring import STRAIGHT, Wiring
from sim_nodes.emulators.xplane import XPlaneEmulator
from sim_nodes.mock_backend import MockBackend
from sim_nodes.mujoco_backend import MujocoBackend
from sim_nodes.on_air import OnAir

if TYPE_CHECKING:
    from sim_nodes.emulators.parameters import Px4ParameterLink

XPLANE, ARDUPLANE, PX4_WING, PX4_THRUSTERS = "xplane", "arduplane", "px4_wing", "px4_thrusters"
TOPICS = "topics:"  # how the link of a PX4 begins
DEVICES = (
    "valves", "pwm_valves", "kobuki", "kingfisher", "ardupilot", XPLANE,
    "valve_topic", "velocity_topic", "thrust_topic", ARDUPLANE, PX4_WING, PX4_THRUSTERS,
)  # fmt: skip
NONE = -1  # an empty list has no type in ROS
CATCH_UP = 25  # ticks at most after a pause of the process; simulated time loses the rest


@dataclass(frozen=True)
class EmulatorSettings(PlantSettings):
    """ROS parameters of an emulator; those of a plant say where it begins, and in which world."""

    device: str = ""  # one of DEVICES
    link: str = ""  # path of the pseudo-terminal or the chip to make, tcp:<port>, udp:<port>, or a topic
    parameters: str = ""  # udp:<port> where a PX4's parameters are asked for; empty: nowhere
    order: tuple[int, ...] = (0, 1, 2, 3, 4, 5, 6, 7)  # which thruster each valve line opens
    channels: tuple[int, ...] = (0, 1, 2, 3, 4, 5, 6, 7)  # of a PWM chip, in the order of its wires
    active_low: bool = True
    bearing: bool = True  # valves have an air bearing beside them
    supply: bool = False  # a valve shuts off the supply of the others
    inverted: bool = False  # a valve node opens its valves at 0
    stamped: bool = False  # a base takes TwistStamped
    message: str = "int16"  # of VALVE_MESSAGES, which a valve node takes
    sides: tuple[str, ...] = STRAIGHT  # that each channel of a base or boat turns, with a '-' where backwards
    dead: tuple[int, ...] = (NONE,)  # wires that are cut

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.device not in DEVICES:
            raise ValueError(str(UnknownNameError("device", self.device, DEVICES)))
        if self.message not in VALVE_MESSAGES:
            raise ValueError(str(UnknownNameError("message", self.message, VALVE_MESSAGES)))
        if not self.link:
            raise ValueError("'link' must be a path, tcp:<port> or udp:<port>.")


class EmulatorNode(Node):
    """Runs device and physics in real time; publishes the true state, and what the device does by itself.

    The latter shows how the robot behaves when its driver is dead.
    """

    def __init__(self, request_exit: RequestExit, *, cli_args: list[str] | None = None) -> None:
        """Build physics and device, and start.

        Raises:
            FulmarError: A parameter or a file is wrong.
        """
        super().__init__("emulator", cli_args=cli_args)
        self.settings = read_parameters(self, EmulatorSettings)
        self._request_exit = request_exit
        robot = load_robot(self.settings.robot)
        scenario = load_scenario(self.settings.scenario)
        self._backend: Backend
        self._backend, self.device = make_emulation(robot, scenario, self.settings)
        if isinstance(self.device, (ValveBank, ValveNode)) and self.settings.bearing:
            self._backend = OnAir(self._backend, scenario)
        self._sample = self._backend.reset(first_episode(robot, self.settings), seed=self.settings.seed)
        self._wiring = Wiring(
            robot,
            order=self.settings.order,
            sides=self.settings.sides,
            dead=[wire for wire in self.settings.dead if wire != NONE],
        )
        self._frames = own_frames(self, robot)
        self._odometry: Publisher | None = None
        if isinstance(self.device, TopicDevice):
            self._subscribe(self.device)
        self._px4 = (
            Px4Side(self, self.device, self.settings) if isinstance(self.device, Px4Emulator) else None
        )
        self._truth = self.create_publisher(Odometry, TRUTH.name, publisher_qos(TRUTH))
        self._state = self.create_publisher(JointState, DEVICE_STATE.name, publisher_qos(DEVICE_STATE))
        self._mocap = self.create_publisher(PoseStamped, MOCAP.name, publisher_qos(MOCAP))
        capture = capture_maker(robot, rate_hz=self.settings.mocap_hz, late_s=self.settings.mocap_late_s)
        self._room = capture(self._publish_pose)
        self._write_truth = OdometryWriter(None, frame="map", child_frame=self._frames.base)
        self._write_pose = PoseWriter(self._frames)
        self._write_state = VectorWriter(robot.actuators.names)
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._guarded, name="emulator", daemon=True)
        settle_memory()
        self._thread.start()

    def stop(self) -> None:
        """Stop, and close the device."""
        self._stop.set()
        self._thread.join(2.0)
        self._room.close()
        if self._px4 is not None:
            self._px4.close()
        self.device.close()
        self._backend.close()

    def _guarded(self) -> None:
        try:
            self._run()
        except Exception as error:  # noqa: BLE001 - whatever fails in the thread must end the process
            self.get_logger().error(f"{type(error).__name__}: {error}")
            self._request_exit(FAILED)

    def _run(self) -> None:
        take_priority(PLANT_PRIORITY)
        take_priority_with_helpers(PLANT_PRIORITY)
        dt = self._backend.robot.timing.physics_dt
        deadlines, began_s, ticks = Deadlines(dt), time.monotonic(), 0
        while deadlines.wait(self._stop):
            now_s = time.monotonic()
            if self._px4 is not None:
                self._px4.serve(now_s)
            command = self._wiring.applied(self.device.command(now_s))
            if isinstance(self._backend, OnAir) and isinstance(self.device, (ValveBank, ValveNode)):
                self._backend.set_bearing(self.device.air)
            due = int((now_s - began_s) / dt) - ticks
            paused = isinstance(self.device, XPlaneEmulator) and self.device.paused
            for _ in range(0 if paused else max(1, min(due, CATCH_UP))):
                self._sample = self._backend.step(command)
            ticks += max(1, due)
            self.device.report(self._sample, now_s)
            stamp_ns = time.time_ns()
            self._publish(self._sample, stamp_ns)
            self._state.publish(self._write_state.write(command, stamp_ns))

    def _subscribe(self, device: TopicDevice) -> None:
        """Subscribe to the device's topic, and publish odometry as the node of such a base or boat does."""
        kind: type = {
            "valve_topic": VALVE_MESSAGES[self.settings.message],
            "thrust_topic": Float32MultiArray,
        }.get(self.settings.device, TwistStamped if self.settings.stamped else Twist)
        self.create_subscription(
            kind, device.address, lambda message: device.receive(values_of(message), time.monotonic()), 1
        )
        if self.settings.device != "valve_topic":
            self._odometry = self.create_publisher(Odometry, ODOMETRY.name, publisher_qos(ODOMETRY))
            self._write_odometry = OdometryWriter(
                self._backend.robot.sensors.odometry,
                frame=self._frames.odom,
                child_frame=self._frames.base,
            )

    def _publish(self, sample: Sample, stamp_ns: int) -> None:
        if sample.truth is not None:
            self._truth.publish(self._write_truth.write(sample.truth, stamp_ns))
        if self._odometry is not None and sample.odometry is not None:
            self._odometry.publish(self._write_odometry.write(sample.odometry, stamp_ns))
        if sample.odometry is not None:
            for sent_ns, state in self._room.see(sample.odometry, stamp_ns):
                self._publish_pose(sent_ns, state)

    def _publish_pose(self, sent_ns: int, state: RigidBodyState) -> None:
        self._mocap.publish(self._write_pose.raw(state, sent_ns))


class Px4Side:
    """The wires of an emulated PX4: px4_msgs, and MAVLink for its parameters."""

    def __init__(self, node: Node, device: Px4Emulator, settings: EmulatorSettings) -> None:
        """Connect; raises ConfigError where px4_msgs is not installed."""
        self._wires = Px4Wires(node, settings.link.removeprefix(TOPICS), as_px4=True)
        device.connect(self._wires)
        self._parameters: Px4ParameterLink | None = None
        if settings.parameters:
            from sim_nodes.emulators.parameters import Px4ParameterLink

            self._parameters = Px4ParameterLink(_number(settings.parameters, "udp"), device.parameters)

    def serve(self, now_s: float) -> None:
        """Answer questions for parameters at a time of the monotonic clock [s]."""
        if self._parameters is not None:
            self._parameters.serve(now_s)

    def close(self) -> None:
        """Close both."""
        self._wires.close()
        if self._parameters is not None:
            self._parameters.close()


def values_of(message: Any) -> list[float]:
    """The numbers of a command of another stack."""
    if hasattr(message, "data"):
        return [float(value[0] if isinstance(value, bytes) else value) for value in message.data]
    twist = getattr(message, "twist", message)
    return [twist.linear.x, twist.angular.z]


def make_emulation(
    robot: Robot, scenario: Scenario, settings: EmulatorSettings
) -> tuple[MockBackend | MujocoBackend, EmulatedDevice]:
    """The simulator and the emulated device of the parameters; raises ConfigError as `make_emulator`."""
    task = load_task(settings.task)
    if settings.device in (XPLANE, ARDUPLANE, PX4_WING):
        core = MockBackend(robot, things=task.things)
        if settings.device == XPLANE:
            return core, XPlaneEmulator(robot, lambda: core.time_s, _number(settings.link, "udp"))
        if settings.device == PX4_WING:
            return core, Px4Emulator(robot, (), wing=True)
        from sim_nodes.emulators.arduplane import ArduPlaneEmulator

        return core, ArduPlaneEmulator(robot, _number(settings.link, "udp"))
    simulator = MujocoBackend.of(robot, task, scenario)
    return simulator, make_emulator(robot, simulator, settings)


def make_emulator(robot: Robot, backend: MujocoBackend, settings: EmulatorSettings) -> EmulatedDevice:
    """The emulated device of the parameters.

    Raises:
        ConfigError: The link is of another kind than the device has.
    """
    if settings.device == "valves":
        return ValveBank(
            Path(settings.link),
            robot,
            order=settings.order,
            active_low=settings.active_low,
            bearing=settings.bearing,
            supply=settings.supply,
        )
    if settings.device == PX4_THRUSTERS:
        return Px4Emulator(robot, settings.order, wing=False)
    if settings.device == "pwm_valves":
        return PwmBank(Path(settings.link), channels=settings.channels, order=settings.order)
    if settings.device == "valve_topic":
        return ValveNode(settings.link, settings.order, inverted=settings.inverted)
    if settings.device == "velocity_topic":
        return TopicDevice(settings.link, 2, timeout_s=BASE_TIMEOUT_S)
    if settings.device == "thrust_topic":
        return TopicDevice(settings.link, 2, timeout_s=NO_TIMEOUT_S)
    if settings.device == "ardupilot":
        from sim_nodes.emulators.ardupilot import ArdupilotEmulator

        return ArdupilotEmulator(_number(settings.link, "udp"))
    link: Link = (
        TcpLink(_number(settings.link, "tcp"))
        if settings.link.startswith("tcp:")
        else PtyLink(Path(settings.link))
    )
    if settings.device == "kingfisher":
        return KingfisherEmulator(link)

    def wheels() -> tuple[float, float]:
        data = backend.data
        return float(data.joint("left_wheel").qpos[0]), float(data.joint("right_wheel").qpos[0])

    return KobukiEmulator(link, wheels, seed=settings.seed)


def _number(link: str, kind: str) -> int:
    number = link.removeprefix(f"{kind}:")
    if not number.isdecimal():
        raise ConfigError(f"link '{link}' must be {kind}:<port>.")
    return int(number)


def main() -> None:
    """Run the node until it is stopped."""
    sys.exit(run_node(EmulatorNode))


if __name__ == "__main__":
    main()
