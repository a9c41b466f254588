"""Controller of commissioning pulses: commands one wire at a time, reads poses, and stops on any problem."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, TwistStamped
from nav_msgs.msg import Odometry
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import Bool

from fulmar_bags.message_reader import stamp_ns
from fulmar_bringup.commissioning.response import Pulse, Track
from fulmar_core.config.errors import RunFailed
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.topics import (
    ACTUATORS_STATE,
    AIR_BEARING,
    DIAGNOSTICS,
    MOCAP,
    ODOMETRY,
    VELOCITY_COMMAND,
    command_wire,
)
from fulmar_core.safety.estop import HOLDS
from fulmar_core.states.rotation import yaw_of
from fulmar_ros.convert import TwistWriter, VectorWriter
from fulmar_ros.operator_subscription import subscribe_every
from fulmar_ros.parameters import name_of, own_frames
from fulmar_ros.qos import publisher_qos, subscriber_qos

MOST_TRAVEL_M = 0.5
LOST_S = 0.5  # without a pose for so long the robot is stopped; the slowest device reports ten times a second
COMMAND_S = 0.02  # between commands: far below the driver's watchdog
STOPS = 5
READY_S = 40.0  # for driver, poses and air to come up


class Session:
    """One robot under commissioning; each command first checks e-stop, driver, poses and distance from the start."""

    def __init__(
        self, node: Node, robot: Robot, *, from_outside: bool, bearing: bool, ended: Callable[[], str]
    ) -> None:
        """Create every endpoint of a node in the robot's namespace.

        Args:
            node: The node.
            robot: The robot.
            from_outside: Whether the pose comes from motion capture alone.
            bearing: Whether the robot floats on an air bearing of its driver.
            ended: Returns which process has ended, or an empty text.
        """
        self._robot, self._name, self._ended = robot, name_of(node, robot), ended
        self._lock = threading.Lock()
        self._poses: list[tuple[float, ...]] = []  # time, x, y, heading and, of odometry, their rates
        self._delay_s = math.inf  # least of all that came: from a stamp to its reception [s]
        self._posed_s = -math.inf
        self._applied: list[tuple[float, bool]] = []
        self._applied_delay_s = math.inf
        self._plant = ("", "", "")
        self._air = not bearing
        self._start: tuple[float, ...] | None = None
        self.needs_poses = True
        wire = command_wire(robot)
        by_velocity = wire is VELOCITY_COMMAND
        frames = own_frames(node, robot)
        self._write = TwistWriter(frames) if by_velocity else VectorWriter(robot.actuators.names)
        kind = TwistStamped if by_velocity else JointState
        self._command = node.create_publisher(kind, wire.name, publisher_qos(wire))
        poses = MOCAP if from_outside else ODOMETRY
        pose_kind = PoseStamped if from_outside else Odometry
        node.create_subscription(pose_kind, poses.name, self._on_pose, subscriber_qos(poses, depth=50))
        subscribe_every(node, JointState, ACTUATORS_STATE, self._on_applied)
        node.create_subscription(
            DiagnosticArray, DIAGNOSTICS.name, self._on_diagnostics, subscriber_qos(DIAGNOSTICS, depth=10)
        )
        if bearing:
            subscribe_every(node, Bool, AIR_BEARING, self._on_air)

    def until_ready(self) -> None:
        """Wait for the driver, its air and poses, with the safe command.

        Raises:
            RunFailed: They do not come, or a process has ended.
        """
        until = time.monotonic() + READY_S
        while lacks := self._lacking():
            self._raise_if_ended()
            level, mode, message = self._plant
            if mode == "fault":
                raise RunFailed(f"driver: {message}")
            if time.monotonic() > until:
                raise RunFailed(
                    f"{lacks} within {READY_S:g} s (the driver reports: {message or level or 'nothing'})"
                )
            self._send(self._robot.actuators.safe_command)
            time.sleep(COMMAND_S)
        with self._lock:
            self._start = self._poses[-1][1:3] if self._poses else None

    def rest(self, seconds: float) -> None:
        """Command nothing for some time [s]; raises as `pulse`."""
        self._hold(self._robot.actuators.safe_command, seconds)

    def pulse(self, command: np.ndarray, seconds: float) -> Pulse:
        """Command something of shape (n,) for some time [s], then nothing; returns when the driver applied it.

        Raises:
            RunFailed: The e-stop, the driver, the poses or the way from the start ended it.
        """
        with self._lock:
            first = len(self._applied)
        self._hold(command, seconds)
        self.rest(0.1)
        with self._lock:
            applied = [time_s for time_s, moves in self._applied[first:] if moves]
            delay_s = self._applied_delay_s
        if not applied:
            raise RunFailed(f"the driver applied nothing of the pulse (it reports: {self._plant[2]})")
        return Pulse(applied[0] + delay_s, applied[-1] + delay_s + self._robot.timing.physics_dt)

    def track(self, since_s: float = -math.inf) -> Track:
        """The poses since a time, by the clock of the pulses [s]."""
        with self._lock:
            rows = np.array(self._poses)
            delay_s = self._delay_s
        times = rows[:, 0] + delay_s
        order = np.argsort(times, kind="stable")
        chosen = order[times[order] >= since_s]
        rates = rows[chosen, 4:7] if rows.shape[1] > 4 else None
        return Track(times[chosen], rows[chosen, 1], rows[chosen, 2], np.unwrap(rows[chosen, 3]), rates)

    def speed_ahead(self, over_s: float) -> float:
        """Mean speed ahead of the last time, by the odometry [m/s]; 0 where poses alone come."""
        track = self.track()
        recent = track.time_s > track.time_s[-1] - over_s
        if track.rates is None:
            return 0.0
        cos, sin = np.cos(track.heading[recent]), np.sin(track.heading[recent])
        return float(np.mean(cos * track.rates[recent, 0] + sin * track.rates[recent, 1]))

    def make_safe(self) -> None:
        """Send the safe command several times; the driver makes safe once more at its own end."""
        for _ in range(STOPS):
            self._send(self._robot.actuators.safe_command)
            time.sleep(COMMAND_S)

    def _hold(self, command: np.ndarray, seconds: float) -> None:
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            self._check()
            self._send(command)
            time.sleep(COMMAND_S)

    def _check(self) -> None:
        self._raise_if_ended()
        _, mode, message = self._plant
        if message.startswith(HOLDS) or mode == "fault":
            raise RunFailed(f"driver: {message}")
        with self._lock:
            age_s = time.monotonic() - self._posed_s
            here = self._poses[-1] if self._poses else None
        if self.needs_poses and age_s > LOST_S:
            raise RunFailed(
                f"no pose for {1e3 * age_s:.0f} ms (limit {1e3 * LOST_S:.0f} ms): is the robot in view?"
            )
        if here is not None and self._start is not None:
            travel = math.dist(here[1:3], self._start)
            if travel > MOST_TRAVEL_M:
                raise RunFailed(
                    f"the robot is {travel:.2f} m from its start (limit {MOST_TRAVEL_M:g} m). Bring it back, "
                    "let it stand still, and run the command again"
                )

    def _lacking(self) -> str:
        _, mode, message = self._plant
        if mode != "running" or message.startswith(HOLDS):
            return "the driver is not ready"
        if not self._command.get_subscription_count() or not self._applied:
            return "the driver does not receive commands"
        if not self._air:
            return "the air bearing is not on"
        if self.needs_poses and time.monotonic() - self._posed_s > LOST_S:
            return "no pose comes"
        return ""

    def _raise_if_ended(self) -> None:
        if end := self._ended():
            raise RunFailed(end)

    def _send(self, command: np.ndarray) -> None:
        self._command.publish(self._write.write(command, 0))

    def _on_pose(self, message: PoseStamped | Odometry) -> None:
        pose = message.pose if isinstance(message, PoseStamped) else message.pose.pose
        q = pose.orientation
        heading = float(yaw_of(np.array([q.x, q.y, q.z, q.w])))
        values: tuple[float, ...] = (pose.position.x, pose.position.y, heading)
        if isinstance(message, Odometry):
            twist, cos, sin = message.twist.twist, math.cos(heading), math.sin(heading)
            ahead, left = twist.linear.x, twist.linear.y
            values += (cos * ahead - sin * left, sin * ahead + cos * left, twist.angular.z)
        if not all(map(math.isfinite, values)):
            return
        now_s, captured_s = time.monotonic(), 1e-9 * stamp_ns(message.header.stamp)
        with self._lock:
            self._posed_s = now_s
            self._delay_s = min(self._delay_s, now_s - captured_s)
            self._poses.append((captured_s, *values))

    def _on_applied(self, message: JointState) -> None:
        now_s, begun_s = time.monotonic(), 1e-9 * stamp_ns(message.header.stamp)
        with self._lock:
            self._applied_delay_s = min(self._applied_delay_s, now_s - begun_s)
            self._applied.append((begun_s, any(message.effort)))

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            if status.name == f"{self._name}: plant":
                mode = next((pair.value for pair in status.values if pair.key == "mode"), "")
                self._plant = (str(status.level), mode, status.message)

    def _on_air(self, message: Bool) -> None:
        self._air = bool(message.data)
