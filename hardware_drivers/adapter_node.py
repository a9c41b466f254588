"""Node that converts the commands of another stack to this robot's command topic."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from geometry_msgs.msg import Twist, TwistStamped
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState
from std_msgs.msg import Float32MultiArray
from std_srvs.srv import SetBool

from fulmar_core.config.errors import BAD_USAGE, ConfigError
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import VELOCITY_COMMAND, command_wire
from fulmar_ros.air_bearing import SERVICE
from fulmar_ros.convert import TwistWriter, VectorWriter
from fulmar_ros.foreign_topics import VALVE_MESSAGES, valve_values
from fulmar_ros.parameters import own_frames, read_parameters
from fulmar_ros.qos import publisher_qos
from fulmar_ros.runtime import RequestExit, run_node
from hardware_drivers.hardware import load_hardware
from hardware_drivers.settings import ThrustTopic, ValveTopic, VelocityTopic
from hardware_drivers.valves import from_message

NEWEST = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)  # matches every publisher
PLANT = "plant"  # name of driver nodes
NO_STAMP = 0  # the command answers no observation of ours
TopicDriver = ValveTopic | VelocityTopic | ThrustTopic


def message_class(driver: TopicDriver) -> type:
    """Message class that an adapter subscribes to for a driver."""
    if isinstance(driver, ValveTopic):
        return VALVE_MESSAGES[driver.message]
    if isinstance(driver, ThrustTopic):
        return Float32MultiArray
    return TwistStamped if driver.stamped else Twist


@dataclass(frozen=True)
class AdapterSettings:
    """ROS parameters of an adapter node."""

    hardware: str = (
        ""  # a file of configs/hardware with the driver `valve_topic`, `velocity_topic` or `thrust_topic`
    )
    topic: str = ""  # subscribe to this instead of the file's topic


class AdapterNode(Node):
    """Publishes each command of another stack on this robot's command topic.

    It repeats nothing: when the other stack falls silent, the watchdog of the driver acts.
    """

    def __init__(self, request_exit: RequestExit, *, cli_args: list[str] | None = None) -> None:
        """Create subscription and publisher.

        Raises:
            ConfigError: A parameter is wrong, or the hardware file has another driver.
        """
        super().__init__("adapter", cli_args=cli_args)
        settings = read_parameters(self, AdapterSettings)
        if not settings.hardware:
            raise ConfigError("parameter 'hardware' of node 'adapter' names no file of configs/hardware.")
        hardware = load_hardware(settings.hardware)
        self._robot = load_robot(hardware.robot)
        driver = hardware.driver
        if not isinstance(driver, (ValveTopic, VelocityTopic, ThrustTopic)):
            raise ConfigError(f"{settings.hardware}: driver '{driver.kind}' is no message of another stack.")
        self._order = driver.order if isinstance(driver, ValveTopic) else ()
        wire = command_wire(self._robot)
        frames = own_frames(self, self._robot)
        by_velocity = wire is VELOCITY_COMMAND
        self._write = TwistWriter(frames) if by_velocity else VectorWriter(self._robot.actuators.names)
        kind = TwistStamped if by_velocity else JointState
        self._publisher = self.create_publisher(kind, wire.name, publisher_qos(wire))
        self._bearing: bool | None = None
        self._enable = self.create_client(SetBool, SERVICE) if self._order else None
        self._request_exit = request_exit
        self._take = self._taker(driver)
        self._subscription = self.create_subscription(
            message_class(driver), settings.topic or driver.topic, self._receive, NEWEST
        )

    def _taker(self, driver: TopicDriver) -> Callable[[Any], None]:
        if isinstance(driver, ValveTopic):
            return self._valves
        if isinstance(driver, ThrustTopic):
            return lambda message: self._pass_on(np.array(message.data, dtype=float))
        return (lambda message: self._velocity(message.twist)) if driver.stamped else self._velocity

    def _receive(self, message: Any) -> None:
        if self._comes_from_our_plant():
            self.get_logger().error(
                f"{self._subscription.topic_name} is the topic of this robot's own driver: its commands would come "
                "back as new ones, and the watchdog would never act. Give the topic of the other controllers, such as "
                "-p topic:=/fp_cmd_mux/autonomous_control_input."
            )
            self._request_exit(BAD_USAGE)
            return
        self._take(message)

    def _velocity(self, twist: Twist) -> None:
        self._pass_on(np.array([twist.linear.x, twist.angular.z]))

    def _valves(self, message: Any) -> None:
        wanted = from_message(valve_values(message), self._order)
        if wanted is None:
            self._refuse(f"{len(message.data)} values, not {len(self._order) + 1} zeros and ones")
            return
        bearing, valves = wanted
        if bearing is not self._bearing and self._enable is not None and self._enable.service_is_ready():
            self._enable.call_async(SetBool.Request(data=bearing))
            self._bearing = bearing
        self._pass_on(valves)

    def _pass_on(self, command: np.ndarray) -> None:
        if len(command) != len(self._robot.actuators.names) or not all(map(math.isfinite, command)):
            self._refuse(f"{len(command)} values, not {len(self._robot.actuators.names)} finite ones")
            return
        self._publisher.publish(self._write.write(command, NO_STAMP))

    def _comes_from_our_plant(self) -> bool:
        """Whether our driver publishes this topic; asked for every message, since a driver may start later."""
        infos = self.get_publishers_info_by_topic(self._subscription.topic_name)
        ours = (PLANT, self.get_namespace())
        return any((info.node_name, info.node_namespace) == ours for info in infos)

    def _refuse(self, what: str) -> None:
        self.get_logger().warning(f"command refused: {what}", throttle_duration_sec=1.0)


def main() -> None:
    """Run the node until it is stopped."""
    sys.exit(run_node(AdapterNode))


if __name__ == "__main__":
    main()
