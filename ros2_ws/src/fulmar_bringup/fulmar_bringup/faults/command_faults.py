"""Commands that nobody may carry out: nonsense from a stranger while the controller hangs, and such that come late."""

from __future__ import annotations

import math
import signal
import threading

import rclpy
from geometry_msgs.msg import TwistStamped
from sensor_msgs.msg import JointState

from fulmar_bringup.faults.fault import Fault
from fulmar_bringup.faults.finding import STAYS_S, Outcome, stopped
from fulmar_bringup.faults.live_system import LiveSystem
from fulmar_bringup.faults.spoiler import delayed
from fulmar_bringup.faults.surroundings import Surroundings
from fulmar_core.robot import Robot
from fulmar_core.topics import VELOCITY_COMMAND, command_wire
from fulmar_ros.qos import publisher_qos

STRANGER_S = 0.02  # between its commands


def commands_not_a_number(live: LiveSystem) -> Outcome:
    """As many values as it should be, each NaN."""
    names = list(live.robot.actuators.names)
    return _nonsense(live, names, [math.nan] * len(names))


def commands_of_wrong_length(live: LiveSystem) -> Outcome:
    """One value too many."""
    names = [*live.robot.actuators.names, "another"]
    return _nonsense(live, names, [1.0] * len(names))


def commands_with_wrong_names(live: LiveSystem) -> Outcome:
    """Actuators of another robot."""
    names = [f"other_{name}" for name in live.robot.actuators.names]
    return _nonsense(live, names, [1.0] * len(names))


def commands_late(live: LiveSystem) -> Outcome:
    """Each command comes long after its observation: nobody knows any more whether it would still be right."""
    since_s = live.until_it_moves()
    limit_s = live.silenced_s
    live.spoiler.spoil = delayed(math.ceil((limit_s + STAYS_S / 4.0) / live.beat_s))
    return stopped(live, since_s, limit_s)


def _nonsense(live: LiveSystem, names: list[str], values: list[float]) -> Outcome:
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
            return stopped(live, since_s, live.silenced_s)
        finally:
            over.set()
            thread.join()
    finally:
        node.destroy_node()


def _without_names(robot: Robot) -> str:
    return "a Twist has neither names nor a length" if command_wire(robot) is VELOCITY_COMMAND else ""


COMMAND_FAULTS = (
    Fault(commands_not_a_number),
    Fault(commands_of_wrong_length, why_not=_without_names),
    Fault(commands_with_wrong_names, why_not=_without_names),
    Fault(commands_late, Surroundings(spoilt=None)),
)
