"""What a controller of a satellite receives beside its state: speeds of its wheels, and its estimated inertia."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from geometry_msgs.msg import InertiaStamped
from rclpy.node import Node
from sensor_msgs.msg import JointState

from fulmar_bags.message_reader import reading_of, stamp_ns
from fulmar_core.actuators.reaction_wheels import ReactionWheels
from fulmar_core.control_loop import ControlLoop
from fulmar_core.robot import Robot
from fulmar_core.sensors.table import SENSORS
from fulmar_core.topics import INERTIA, SENSOR_WIRES
from fulmar_ros.qos import subscriber_qos

WHEELS_LAST_NS = 1_000_000_000  # older speeds are not used [ns]
INERTIA_LASTS_NS = 10_000_000_000  # an estimate that is not repeated for so long was withdrawn [ns]


class SatelliteInputs:
    """Subscribes wheel speeds and inertia of a robot with reaction wheels; of any other robot nothing."""

    def __init__(self, node: Node, robot: Robot, on_wheels: Callable[[], None], *, lockstep: bool) -> None:
        """Create the subscriptions.

        Args:
            node: Their owner.
            robot: The robot.
            on_wheels: Called after each message with speeds.
            lockstep: Whether a step waits for the speeds of its time.
        """
        self._names: tuple[str, ...] = ()
        self._waits = False
        self._wheels: tuple[int, np.ndarray] | None = None  # stamp [ns], and speeds, shape (1, count)
        self._inertia: tuple[int, np.ndarray] | None = None
        self._on_wheels, self._subscriptions = on_wheels, []
        if not isinstance(robot.actuators, ReactionWheels):
            return
        self._names = robot.actuators.wheel_names
        if "wheels" in robot.sensors.specs:
            self._waits = lockstep and not robot.sensors.specs["wheels"].rate_hz
            wire = SENSOR_WIRES["wheels"]
            qos = subscriber_qos(wire, reliable=lockstep)
            self._subscriptions.append(
                node.create_subscription(JointState, wire.name, self._take_wheels, qos)
            )
        qos = subscriber_qos(INERTIA, reliable=True)
        self._subscriptions.append(
            node.create_subscription(InertiaStamped, INERTIA.name, self._take_inertia, qos)
        )

    def destroy(self, node: Node) -> None:
        """Destroy the subscriptions."""
        for subscription in self._subscriptions:
            node.destroy_subscription(subscription)

    def lacks_something_of(self, time_ns: int) -> bool:
        """Whether a step of lock step waits for the speeds of its time [ns]."""
        return self._waits and (self._wheels is None or self._wheels[0] < time_ns)

    def fill(self, loop: ControlLoop, time_ns: int) -> None:
        """Give what is young enough at a time [ns] to the loop."""
        loop.wheels = _young(self._wheels, time_ns, WHEELS_LAST_NS)
        loop.inertia = _young(self._inertia, time_ns, INERTIA_LASTS_NS)

    def _take_wheels(self, message: JointState) -> None:
        by_name = dict(
            zip(message.name, reading_of(message, SENSORS["wheels"]).value.speeds.tolist(), strict=False)
        )
        speeds = np.array([[by_name.get(name, np.nan) for name in self._names]])
        if np.isfinite(speeds).all():  # speeds that are not numbers count as not measured
            self._wheels = stamp_ns(message.header.stamp), speeds
            self._on_wheels()

    def _take_inertia(self, message: InertiaStamped) -> None:
        its = message.inertia
        tensor = np.array(
            [[its.ixx, its.ixy, its.ixz], [its.ixy, its.iyy, its.iyz], [its.ixz, its.iyz, its.izz]]
        )
        if np.isfinite(tensor).all() and np.linalg.eigvalsh(tensor)[0] > 0.0:
            self._inertia = stamp_ns(message.header.stamp), tensor


def _young(newest: tuple[int, np.ndarray] | None, time_ns: int, lasts_ns: int) -> np.ndarray | None:
    if newest is None or time_ns - newest[0] > lasts_ns:
        return None
    return newest[1]
