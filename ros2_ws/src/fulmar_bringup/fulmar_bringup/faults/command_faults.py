"""Commands that nobody could carry out, from a stranger who goes on after the controller fell silent."""

from __future__ import annotations

import math
import signal
import threading
from collections.abc import Callable

import rclpy
from geometry_msgs.msg import TwistStamped
from sensor_msgs.msg import JointState

from fulmar_bringup.faults.finding import Finding, stopped
from fulmar_bringup.faults.live_system import LiveSystem
from fulmar_core.topics import VELOCITY_COMMAND, command_wire
from fulmar_ros.qos import publisher_qos

STRANGER_S = 0.02  # between its commands


def commands_not_a_number(live: LiveSystem) -> Finding:
    """As many values as it should be, each NaN."""
    names = list(live.robot.actuators.names)
    return _nonsense(live, "commands_not_a_number", names, [math.nan] * len(names))


def commands_of_wrong_length(live: LiveSystem) -> Finding:
    """One value too many."""
    names = [*live.robot.actuators.names, "another"]
    return _nonsense(live, "commands_of_wrong_length", names, [1.0] * len(names))


def commands_with_wrong_names(live: LiveSystem) -> Finding:
    """Actuators of another robot."""
    names = [f"other_{name}" for name in live.robot.actuators.names]
    return _nonsense(live, "commands_with_wrong_names", names, [1.0] * len(names))


def command_faults(live_robot_has_names: bool) -> tuple[Callable[[LiveSystem], Finding], ...]:
    """Those that a robot's command can have: a Twist has neither names nor a length."""
    named = (commands_of_wrong_length, commands_with_wrong_names) if live_robot_has_names else ()
    return (commands_not_a_number, *named)


def _nonsense(live: LiveSystem, name: str, names: list[str], values: list[float]) -> Finding:
    """Nonsense must not feed the watchdog, nor reach an actuator."""
    wire = command_wire(live.robot)
    node = rclpy.create_node("stranger", namespace=f"/{live.plan.robot}")
    over = threading.Event()
    try:
        if wire is VELOCITY_COMMAND:
            publisher = node.create_publisher(TwistStamped, wire.name, publisher_qos(wire))
            twist = TwistStamped()
            twist.twist.linear.x, twist.twist.angular.z = values
            message: TwistStamped | JointState = twist
        else:
            publisher = node.create_publisher(JointState, wire.name, publisher_qos(wire))
            message = JointState(name=names, effort=values)

        def talk() -> None:
            while not over.wait(STRANGER_S):
                publisher.publish(message)

        since_s = live.until_it_moves()
        live.send("controller", signal.SIGSTOP)
        thread = threading.Thread(target=talk, name="stranger", daemon=True)
        thread.start()
        try:
            return stopped(live, name, since_s, live.watchdog_s + live.tick_s + live.ramp_s)
        finally:
            over.set()
            thread.join()
    finally:
        node.destroy_node()
