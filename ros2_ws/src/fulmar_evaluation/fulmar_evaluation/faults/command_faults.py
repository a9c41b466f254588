"""Faults of commands: invalid, late, from a second node, or over a bad cable."""

from __future__ import annotations

import math
import time
from dataclasses import replace

from geometry_msgs.msg import TwistStamped
from sensor_msgs.msg import JointState

from fulmar_core.robots.robot import Robot
from fulmar_core.robots.topics import VELOCITY_COMMAND, command_wire
from fulmar_evaluation.faults.fault import STAYS_S, Fault, Outcome, stopped, went_on
from fulmar_evaluation.faults.fault_environment import COMMANDS, FaultEnvironment, delayed
from fulmar_evaluation.faults.live_system import LiveSystem, repeated
from fulmar_evaluation.faults.two_hosts import CUT, LOSSY, why_not
from fulmar_ros.qos import publisher_qos

STRANGER_S = 0.02  # between its commands
# Until nodes on one computer know of a new publisher, and for the look of a tenth of a second
DISCOVERY_S = 0.3
DRIVES_S = 8.0  # forty commands at 5 Hz


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
    live.injector.change = delayed(limit_s + STAYS_S / 4.0)
    return stopped(live, since_s, limit_s)


def commands_from_another_node(live: LiveSystem) -> Outcome:
    """A second node publishes good commands while the controller goes on: the plant obeys neither, and names both."""
    wire, robot = command_wire(live.robot), live.robot
    message = _message(live, list(robot.actuators.names), [1.0] * len(robot.actuators.names))
    with live.stranger() as node:
        since_s = live.until_a_move_is_on_record()
        publisher = node.create_publisher(type(message), wire.name, publisher_qos(wire))
        with repeated(lambda: publisher.publish(message), STRANGER_S):
            outcome = stopped(live, since_s, DISCOVERY_S + live.tick_s + live.ramp_s)
    names = ", ".join(f"{live.plan.namespace}/{node}" for node in ("controller", "stranger"))
    return replace(outcome, passed=outcome.passed and names in outcome.reaction)


def _nonsense(live: LiveSystem, names: list[str], values: list[float]) -> Outcome:
    """Nonsense must not feed the watchdog, nor reach an actuator."""
    message = _message(live, names, values)
    since_s = live.until_it_moves()
    live.injector.change = lambda _good: message
    return stopped(live, since_s, live.silenced_s)


def _message(live: LiveSystem, names: list[str], values: list[float]) -> TwistStamped | JointState:
    if command_wire(live.robot) is not VELOCITY_COMMAND:
        return JointState(name=names, effort=values)
    twist = TwistStamped()
    twist.twist.linear.x, twist.twist.angular.z = values
    return twist


def _without_names(robot: Robot) -> str:
    return "a Twist has neither names nor a length" if command_wire(robot) is VELOCITY_COMMAND else ""


def cable_cut(live: LiveSystem) -> Outcome:
    """Nothing passes any more, in either direction."""
    since_s = live.until_it_moves()
    live.hosts.cable.quality = CUT
    return stopped(live, since_s, live.silenced_s)


def cable_lossy(live: LiveSystem) -> Outcome:
    """A tenth of all frames is lost, and the others are 10 to 30 ms late, in both directions."""
    since_s = live.until_it_moves()
    live.hosts.cable.quality = LOSSY
    time.sleep(DRIVES_S)
    reaction = f"driven for {DRIVES_S:g} s without a pause"
    return went_on(live, since_s, detected_by="", reaction=reaction, correct=True)


def _without_two_hosts(_robot: Robot) -> str:
    return why_not()


COMMAND_FAULTS = (
    Fault(commands_not_a_number, COMMANDS),
    Fault(commands_of_wrong_length, COMMANDS, _without_names),
    Fault(commands_with_wrong_names, COMMANDS, _without_names),
    Fault(commands_late, COMMANDS),
    Fault(commands_from_another_node),
)
CABLE_FAULTS = (
    Fault(cable_cut, FaultEnvironment(two_hosts=True), _without_two_hosts),
    Fault(cable_lossy, FaultEnvironment(two_hosts=True), _without_two_hosts),
)
