"""Topics of PX4's uXRCE-DDS client, of its companion's side and of PX4's own, by the names of their message types."""

from __future__ import annotations

import importlib
import threading
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from typing import Any

import rclpy
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

from fulmar_core.config.errors import ConfigError
from fulmar_ros.runtime import spinning

# By message type. Releases from 1.16 on write the version of a message behind its topic, unless that is 0.
TO_PX4 = {
    "OffboardControlMode": ("fmu/in/offboard_control_mode",),
    "ActuatorMotors": ("fmu/in/actuator_motors",),
    "ActuatorServos": ("fmu/in/actuator_servos",),
    "VehicleAttitudeSetpoint": ("fmu/in/vehicle_attitude_setpoint",),
    "VehicleRatesSetpoint": ("fmu/in/vehicle_rates_setpoint",),
    "VehicleCommand": ("fmu/in/vehicle_command",),
}
FROM_PX4 = {
    "VehicleOdometry": ("fmu/out/vehicle_odometry",),
    "SensorCombined": ("fmu/out/sensor_combined",),
    "VehicleStatus": ("fmu/out/vehicle_status_v1", "fmu/out/vehicle_status"),
    "VehicleCommandAck": ("fmu/out/vehicle_command_ack",),
    "TimesyncStatus": ("fmu/out/timesync_status",),
}
# PX4's client offers best effort, and asks for it: a reliable publisher matches as well.
RECEIVE = QoSProfile(
    reliability=ReliabilityPolicy.BEST_EFFORT,
    durability=DurabilityPolicy.VOLATILE,
    history=HistoryPolicy.KEEP_LAST,
    depth=5,
)
OFFER = QoSProfile(depth=5)


class Px4Wires:
    """One side of the wires between a companion and PX4, on a node and a thread of their own.

    A driver waits for PX4 while its own node is not served yet, so that node cannot receive for it.
    """

    def __init__(self, node: Node, topics: str, *, as_px4: bool = False) -> None:
        """Prepare.

        Args:
            node: Whose process and context it is.
            topics: Namespace before fmu/in and fmu/out, with a slash in front; empty: none.
            as_px4: Play PX4's side.

        Raises:
            ConfigError: px4_msgs is not installed, or of a release without one of the messages.
        """
        sent, received = (FROM_PX4, TO_PX4) if as_px4 else (TO_PX4, FROM_PX4)
        self._types = {kind: _type_of(kind) for kind in (*sent, *received)}
        self._receive: Callable[[str, Any], None] = lambda _kind, _message: None
        self._node = rclpy.create_node(
            "px4" if as_px4 else "px4_link",
            context=node.context,
            namespace=node.get_namespace(),
            use_global_arguments=False,
            enable_rosout=False,
            start_parameter_services=False,
        )
        self._publishers: dict[str, Publisher] = {
            kind: self._node.create_publisher(self._types[kind], f"{topics}/{names[0]}", OFFER)
            for kind, names in sent.items()
        }
        for kind, names in received.items():
            for name in names:
                self._node.create_subscription(
                    self._types[kind], f"{topics}/{name}", self._giver(kind), RECEIVE
                )
        self._sending = threading.Lock()
        self._closed = False
        self._running = ExitStack()
        self._failed: Exception | None = None
        self._running.enter_context(spinning(self._node, self._fail))

    def listen(self, receive: Callable[[str, Any], None]) -> None:
        """Give every message that comes to a function, with the name of its type."""
        self._receive = receive

    def send(self, kind: str, fields: Mapping[str, Any]) -> None:
        """Publish a message; fields that are not named are 0.

        Raises:
            Exception: What a callback raised before; nothing is received any more.
        """
        if self._failed is not None:
            raise self._failed
        message = self._types[kind](**fields)
        with self._sending:
            if not self._closed:
                self._publishers[kind].publish(message)

    def close(self) -> None:
        """Stop receiving, and destroy the node; once."""
        with self._sending:
            if self._closed:
                return
            self._closed = True
        self._running.close()

    def _giver(self, kind: str) -> Callable[[Any], None]:
        return lambda message: self._receive(kind, message)

    def _fail(self, error: Exception) -> None:
        self._failed = error


def _type_of(kind: str) -> Any:
    try:
        return getattr(importlib.import_module("px4_msgs.msg"), kind)
    except (ModuleNotFoundError, AttributeError) as error:
        raise ConfigError(
            "drivers of PX4 need its messages, and px4_msgs is not installed. Run: fulmar install-px4"
        ) from error
