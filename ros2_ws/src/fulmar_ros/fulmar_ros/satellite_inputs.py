"""What a controller of a satellite receives beside its state: speeds of its wheels, and its estimated inertia."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from geometry_msgs.msg import InertiaStamped
from rclpy.node import Node
from rclpy.subscription import Subscription
from sensor_msgs.msg import JointState

from fulmar_bags.message_reader import reading_of, stamp_ns
from fulmar_core.controllers.controller import INERTIA as INERTIA_ESTIMATE
from fulmar_core.estimators.inertia.momentum_balance import is_body
from fulmar_core.robots.actuators.reaction_wheels import ReactionWheels
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.sensors.table import SENSORS
from fulmar_core.robots.sensors.wheels import NAME as WHEELS
from fulmar_core.robots.topics import INERTIA, SENSOR_WIRES
from fulmar_ros.operator_subscription import destroy_all, subscribe_every
from fulmar_ros.qos import subscriber_qos

WHEELS_LAST_NS = 1_000_000_000  # older speeds are not used [ns]
MOST_INERTIA = (
    5.0  # of a body by that of its file: tanks that run dry and panels that unfold change it by less [-]
)
INERTIA_LASTS_NS = 10_000_000_000  # an estimate that is not repeated for so long was withdrawn [ns]


class SatelliteInputs:
    """Subscribes wheel speeds and inertia of a robot with reaction wheels; of any other robot nothing.

    Attributes:
        refused: How many messages were refused.
        refusal: Why the newest of them was; empty if the newest message was not.
    """

    def __init__(self, node: Node, robot: Robot, on_wheels: Callable[[], None], *, lockstep: bool) -> None:
        """Create the subscriptions.

        Args:
            node: Their owner.
            robot: The robot.
            on_wheels: Called after each message with speeds.
            lockstep: Whether a step waits for the speeds of its time.
        """
        self._robot = robot
        self._names: tuple[str, ...] = ()
        self._waits = False
        self._wheels: tuple[int, np.ndarray] | None = None  # stamp [ns], and speeds, shape (1, count)
        self._inertia: tuple[int, np.ndarray] | None = None
        self._on_wheels = on_wheels
        self.followed: dict[str, list[Subscription]] = {}  # by topic
        self.refused, self.refusal = 0, ""
        if not isinstance(robot.actuators, ReactionWheels):
            return
        self._names = robot.actuators.wheel_names
        if WHEELS in robot.sensors.specs:
            self._waits = lockstep and not robot.sensors.specs[WHEELS].rate_hz
            wire = SENSOR_WIRES[WHEELS]
            qos = subscriber_qos(wire, reliable=lockstep)
            made = node.create_subscription(JointState, wire.name, self._take_wheels, qos)
            self.followed[wire.name] = [made]
        self.followed[INERTIA.name] = subscribe_every(node, InertiaStamped, INERTIA, self._take_inertia)

    def destroy(self, node: Node) -> None:
        """Destroy the subscriptions."""
        destroy_all(node, self.followed.values())

    def lacks_something_of(self, time_ns: int) -> bool:
        """Whether a step of lock step waits for the speeds of its time [ns]."""
        return self._waits and (self._wheels is None or self._wheels[0] < time_ns)

    def readings(self, time_ns: int) -> dict[str, np.ndarray]:
        """What is young enough at a time [ns], see `Inputs.readings`."""
        newest = (
            (WHEELS, self._wheels, WHEELS_LAST_NS),
            (INERTIA_ESTIMATE, self._inertia, INERTIA_LASTS_NS),
        )
        return {name: one[1] for name, one, lasts in newest if one is not None and time_ns - one[0] <= lasts}

    def _take_wheels(self, message: JointState) -> None:
        reading = reading_of(message, SENSORS[WHEELS])
        problem = SENSORS[WHEELS].problem(reading, self._robot)
        if self._accept(problem):  # refused speeds count as not measured
            by_name = dict(zip(message.name, reading.value.speeds.tolist(), strict=True))
            speeds = np.array([[by_name[name] for name in self._names]])
            self._wheels = stamp_ns(message.header.stamp), speeds
            self._on_wheels()

    def _take_inertia(self, message: InertiaStamped) -> None:
        its = message.inertia
        tensor = np.array(
            [[its.ixx, its.ixy, its.ixz], [its.ixy, its.iyy, its.iyz], [its.ixz, its.iyz, its.izz]]
        )
        if self._accept(_inertia_problem(tensor, self._robot.body.inertia_matrix)):
            self._inertia = stamp_ns(message.header.stamp), tensor

    def _accept(self, problem: str) -> bool:
        self.refusal = problem
        self.refused += bool(problem)
        return not problem


def _inertia_problem(tensor: np.ndarray, known: np.ndarray) -> str:
    """Why an estimate is the inertia of no body that is built as a robot's file says."""
    if not np.isfinite(tensor).all() or not is_body(tensor):
        return "the inertia on the wire is that of no body"
    shares = np.linalg.eigvalsh(tensor) / np.linalg.eigvalsh(known)
    if shares.min() < 1.0 / MOST_INERTIA or shares.max() > MOST_INERTIA:
        return f"the inertia on the wire differs from that of the robot's file by a factor of over {MOST_INERTIA:g}"
    return ""
