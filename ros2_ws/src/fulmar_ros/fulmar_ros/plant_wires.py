"""What a plant publishes and hears: one object for every wire on its side."""

from __future__ import annotations

import threading
import time
from collections.abc import Sequence
from functools import partial

import numpy as np
from geometry_msgs.msg import PoseStamped, TwistStamped
from nav_msgs.msg import Odometry
from rclpy.lifecycle import LifecycleNode
from rclpy.publisher import Publisher
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Bool, String
from std_srvs.srv import Trigger

from fulmar_core.backend import Sample
from fulmar_core.planar import at_rest, rigid_of
from fulmar_core.process import CONTROL_PRIORITY, take_priority_with_helpers
from fulmar_core.robot import Robot
from fulmar_core.safety.actuator_guard import ActuatorGuard
from fulmar_core.safety.input_gate import BACK_NS
from fulmar_core.state import RigidBodyState
from fulmar_core.topics import (
    ACTUATORS_STATE,
    CLOCK,
    ESTOP,
    ESTOP_RELEASED,
    GIVE_BACK,
    IMU,
    MOCAP,
    ODOMETRY,
    TELEOP,
    TRUTH,
    VELOCITY_COMMAND,
    command_wire,
    thing_wire,
)
from fulmar_ros.command_writers import writers_of
from fulmar_ros.convert import ImuWriter, OdometryWriter, PoseWriter, VectorWriter, stamp_of
from fulmar_ros.deadline import Spread
from fulmar_ros.node_robot import own_frames
from fulmar_ros.operator_subscription import subscribe_operator
from fulmar_ros.paced_capture import MakeCapture
from fulmar_ros.qos import publisher_qos, subscriber_qos
from fulmar_ros.sent_states import SentStates
from fulmar_ros.simulated_time import SimulatedTime
from fulmar_ros.subscriber_wait import FLUSH_S, flush, publish_patiently
from fulmar_ros.wire_readers import TwistReader, VectorReader

CLOCK_PERIOD_NS = 5_000_000  # /clock at most 200 times a wall-clock second
LAST_WORDS_S = 0.3  # for readers in real time to get what was published last


class PlantWires:
    """Publishers, the command subscription, and the times between them."""

    def __init__(
        self,
        node: LifecycleNode,
        robot: Robot,
        guard: ActuatorGuard,
        *,
        simulated: bool,
        clock: bool = False,
        odometry: bool = True,
        mocap: MakeCapture | None = None,
        lockstep: bool = False,
        simulated_time: SimulatedTime | None = None,
    ) -> None:
        """Create every endpoint.

        Args:
            node: Owner of the endpoints.
            robot: The robot.
            guard: Takes the commands; only touched under `self.lock`.
            simulated: Whether the truth is published.
            clock: Whether the clock is published.
            odometry: Whether the plant says where it is; if not, somebody else does.
            mocap: Publish the poses of the motion capture that it makes.
            lockstep: Whether the plant waits for the controller's answers, and for readers that lag behind. By the
                clock, without it, a person may take the actuators, and commands go before other work.
            simulated_time: Clock of a simulated plant, by which actuators follow commands.
        """
        self._mocap = mocap(self._publish_pose) if mocap is not None else None
        self._prior = lockstep  # whether the threads that commands pass have what priority they need
        self._publish = publish_patiently if lockstep else Publisher.publish
        self._flush_s = FLUSH_S if lockstep else LAST_WORDS_S
        self.lock = threading.Condition()
        self.latency_ms = Spread()
        self.answers = 0  # states that a command has answered
        self.listening = True  # whether commands of controllers are heard
        self._guard = guard
        self._simulated_time = simulated_time
        self._sent = SentStates(guard.watchdog.timeout_ns)
        # Who knows where the robot is from elsewhere answers stamps of another clock.
        self._knows_ages = simulated or odometry
        self.answered_ns: int | None = None  # stamp of the newest command that was taken
        self._clock_ns = 0
        self._captured_ns = 0
        self._qos = qos = partial(publisher_qos, lockstep=lockstep)
        self._odometry = node.create_publisher(Odometry, ODOMETRY.name, qos(ODOMETRY)) if odometry else None
        self._poses = (
            node.create_publisher(PoseStamped, MOCAP.name, qos(MOCAP)) if mocap is not None else None
        )
        self._imu = node.create_publisher(Imu, IMU.name, qos(IMU))
        self._state = node.create_publisher(JointState, ACTUATORS_STATE.name, qos(ACTUATORS_STATE))
        self._truth = node.create_publisher(Odometry, TRUTH.name, qos(TRUTH)) if simulated else None
        self._clock = node.create_publisher(Clock, CLOCK.name, qos(CLOCK)) if clock else None
        self._frames = frames = own_frames(node, robot)
        self._write_odometry = OdometryWriter(
            robot.sensors.odometry, frame=frames.odom, child_frame=frames.base
        )
        self._write_pose = PoseWriter(frames)
        self._write_truth = OdometryWriter(None, frame="map", child_frame=frames.base)
        self._write_imu = ImuWriter(robot, frames)
        self._write_state = VectorWriter(robot.actuators.names)
        self._node = node
        self._things: dict[
            str, Publisher
        ] = {}  # most robots are alone, so that each is made when it is there
        wire = command_wire(robot)
        # By the clock the newest command counts. A reliable reader would hold it back while one that a network lost is
        # asked for again, which takes seconds.
        commands = subscriber_qos(wire, reliable=lockstep)
        names = robot.actuators.names
        by_velocity = wire is VELOCITY_COMMAND
        self._reader = TwistReader(names, frames) if by_velocity else VectorReader(names)
        self._commands = node.create_subscription(
            TwistStamped if by_velocity else JointState, wire.name, self._on_command, commands, raw=True
        )
        released = subscriber_qos(ESTOP_RELEASED, reliable=True)
        self._operator = [
            *subscribe_operator(node, Bool, ESTOP, self._on_estop),
            node.create_subscription(String, ESTOP_RELEASED.name, self._on_estop_released, released),
        ]
        if not lockstep:
            teleop = subscriber_qos(TELEOP, reliable=True)
            self._operator.append(node.create_subscription(JointState, TELEOP.name, self._on_teleop, teleop))
        # What it subscribes, and whether reliably.
        self.subscribed = {
            wire: lockstep,
            ESTOP: True,
            ESTOP_RELEASED: True,
            **({} if lockstep else {TELEOP: True}),
        }
        self._give_back = node.create_service(Trigger, GIVE_BACK, self._on_give_back)

    def destroy(self, node: LifecycleNode) -> None:
        """Give every endpoint back."""
        self.end_capture()
        for subscription in (self._commands, *self._operator):
            node.destroy_subscription(subscription)
        node.destroy_service(self._give_back)
        for publisher in self._publishers():
            node.destroy_publisher(publisher)

    def _publishers(self) -> list[Publisher]:
        made = (self._odometry, self._poses, self._imu, self._state, self._truth, self._clock)
        return [*(publisher for publisher in made if publisher is not None), *self._things.values()]

    def subscribers(self) -> int:
        """Matched subscriptions of the odometry, of the poses in its place, or of the actuators' state."""
        return int((self._odometry or self._poses or self._state).get_subscription_count())

    def publish_sample(self, sample: Sample, time_ns: int, *, resend: bool = False) -> None:
        """Publish what the backend reports; the odometry first, since somebody waits for it.

        Args:
            sample: From the backend.
            time_ns: Time of measurement, where the sample names none [ns].
            resend: Only the odometry, once more.
        """
        if sample.stamp_ns is not None:
            if 0 <= self._captured_ns - sample.stamp_ns <= BACK_NS:
                return  # a device that has nothing new; further back, somebody has set the clock
            time_ns = self._captured_ns = sample.stamp_ns
        with self.lock:
            self._sent.note(time_ns, time.monotonic_ns())
        for name, pose in sample.things.items():
            self._publish_thing(name, pose, time_ns)
        if self._odometry is not None and sample.odometry is not None:
            self._publish(self._odometry, self._write_odometry.raw(sample.odometry, time_ns))
        if resend:
            return
        if sample.imu is not None and self._imu.get_subscription_count():
            self._publish(self._imu, self._write_imu.write(sample.imu, time_ns))
        if self._mocap is not None and sample.odometry is not None:
            for stamp, state in self._mocap.see(sample.odometry, time_ns):
                self._publish_pose(stamp, state)
        self.publish_truth(sample, time_ns)
        now = time.monotonic_ns()
        if self._clock is not None and now - self._clock_ns >= CLOCK_PERIOD_NS:
            self._publish(self._clock, Clock(clock=stamp_of(time_ns)))
            self._clock_ns = now

    def _publish_pose(self, stamp: int, state: RigidBodyState) -> None:
        if self._poses is not None:
            self._publish(self._poses, self._write_pose.write(state, stamp))

    def _publish_thing(self, name: str, pose: np.ndarray, time_ns: int) -> None:
        if name not in self._things:
            wire = thing_wire(name)
            self._things[name] = self._node.create_publisher(PoseStamped, wire.name, self._qos(wire))
        self._publish(self._things[name], self._write_pose.write(rigid_of(at_rest(*pose)), time_ns))

    def publish_truth(self, sample: Sample, time_ns: int) -> None:
        """Publish where the robot really is, if the backend knows and somebody listens."""
        if self._truth is not None and sample.truth is not None and self._truth.get_subscription_count():
            self._publish(self._truth, self._write_truth.raw(sample.truth, time_ns))

    def publish_applied(self, command: np.ndarray, time_ns: int) -> None:
        """Publish what the actuators are doing from this time on, if somebody listens."""
        if self._state.get_subscription_count():
            self._publish(self._state, self._write_state.raw(command, time_ns))

    def end_capture(self) -> None:
        """Publish no pose any more before the next measurement."""
        if self._mocap is not None:
            self._mocap.close()

    def expect_no_answers(self) -> None:
        """Take and time no command any more that answers what was sent so far."""
        with self.lock:
            self._sent.close()

    def flush(self) -> None:
        """Wait, not for ever, until every subscriber has the last states."""
        flush(self._publishers(), self._flush_s)

    def wait_for_answer(self, time_ns: int, timeout_s: float) -> bool:
        """Wait until a command answers the odometry of this stamp; call with `lock` held."""
        return self.lock.wait_for(lambda: self.answered_ns == time_ns, timeout_s)

    def _on_command(self, data: bytes) -> None:
        command = self._reader.read(data)
        if command is not None:  # what is damaged feeds no watchdog
            self._take(command.names, command.values, command.stamp_ns)

    def _on_estop(self, message: Bool) -> None:
        with self.lock:
            self._guard.estop.receive(bool(message.data), time.monotonic_ns())

    def _on_estop_released(self, _message: String) -> None:
        with self.lock:
            self._guard.estop.release(time.monotonic_ns())

    def _on_teleop(self, message: JointState) -> None:
        with self.lock:
            self._guard.offer_by_hand(
                message.name, message.effort, time.monotonic_ns(), plant_ns=self._plant_ns
            )

    def _on_give_back(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        with self.lock:
            problem = self._guard.give_back(time.monotonic_ns())
        response.success, response.message = not problem, problem or "the controller has the robot again"
        return response

    def see_writers(self) -> None:
        """Report to the guard which nodes publish commands."""
        writers = writers_of(self._node, self._commands)
        with self.lock:
            self._guard.publishers.see(writers, time.monotonic_ns())

    @property
    def _plant_ns(self) -> int | None:
        return None if self._simulated_time is None else self._simulated_time.now_ns

    def _take(self, names: Sequence[str], values: Sequence[float], stamp: int) -> None:
        now = time.monotonic_ns()
        if not self.listening:
            return
        if not self._prior:
            take_priority_with_helpers(CONTROL_PRIORITY)
            self._prior = True
        self.see_writers()  # before the first command of a second publisher is carried out
        with self.lock:
            outdated = self._knows_ages and self._sent.outdated(stamp, now)
            taken = self._guard.offer(
                names, values, now, stamp_ns=stamp, outdated=outdated, plant_ns=self._plant_ns
            )
            latency_ns = self._sent.answered(stamp, now)
            if taken and latency_ns is not None:
                self.latency_ms.add(latency_ns / 1e6)
                self.answers += 1
            if taken:
                self.answered_ns = stamp
            self.lock.notify_all()
