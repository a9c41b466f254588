"""Faults of operator inputs: a volatile e-stop publisher, a teleoperation node that dies."""

from __future__ import annotations

import signal
from contextlib import AbstractContextManager

from sensor_msgs.msg import Joy
from std_msgs.msg import Bool

from fulmar_core.config.errors import RunFailed
from fulmar_core.loop.teleop import JoyLayout
from fulmar_core.robots.topics import ESTOP, JOY
from fulmar_evaluation.faults.fault import Fault, Outcome, killed_and_stopped, stopped
from fulmar_evaluation.faults.fault_environment import FaultEnvironment
from fulmar_evaluation.faults.live_system import LiveSystem, repeated
from fulmar_evaluation.faults.observer import wait_for
from fulmar_ros.qos import publisher_qos

DEFAULT_QOS = 10  # a depth alone: reliable and volatile
NODES = 4  # plant, controller, e-stop node and recorder subscribe the e-stop
MATCH_S = 10.0


def estop_pressed_once_by_a_volatile_publisher(live: LiveSystem) -> Outcome:
    """One message; the e-stop node, which goes on publishing, must not end it."""
    with live.stranger() as node:
        publisher = node.create_publisher(Bool, ESTOP.name, DEFAULT_QOS)
        # A volatile publisher matches one of the two subscriptions of each node.
        if not wait_for(lambda: publisher.get_subscription_count() >= NODES, MATCH_S):
            raise RunFailed(f"fewer than {NODES} nodes subscribe {publisher.topic_name} within {MATCH_S:g} s")
        since_s = live.until_a_move_is_on_record()
        publisher.publish(Bool(data=True))
        return stopped(live, since_s, live.silenced_s)


GAMEPAD_S = 0.05  # between its messages
TAKES_S = 10.0  # for a gamepad to be received, on a busy machine
LAYOUT = JoyLayout()


def _hand(live: LiveSystem, number: signal.Signals) -> Outcome:
    """The node that carries a hand, while it drives: the robot stops, and the controller does not get it back."""
    live.until_it_moves()
    with _held_gamepad(live):
        if not wait_for(lambda: _commanded_by(live) == "person", TAKES_S):
            raise RunFailed(f"the hand did not get the robot within {TAKES_S:g} s")
        node = live.process("teleop")
        since_s = live.until_it_moves()
        node.send_signal(number)
        return stopped(live, since_s, live.silenced_s)


def _commanded_by(live: LiveSystem) -> str:
    statuses = [status for status in live.observer.statuses_since(0.0) if status.who == "plant"]
    return statuses[-1].values.get("commanded_by", "") if statuses else ""


def _held_gamepad(live: LiveSystem) -> AbstractContextManager[None]:
    """A gamepad whose switch is held and whose stick is pushed ahead."""
    axes, buttons = [0.0] * (max(LAYOUT.axes) + 1), [0] * (LAYOUT.give_back_button + 1)
    axes[LAYOUT.ahead_axis], buttons[LAYOUT.deadman_button] = 1.0, 1
    publisher = live.bystander.create_publisher(Joy, JOY.name, publisher_qos(JOY))
    return repeated(lambda: publisher.publish(Joy(axes=axes, buttons=buttons)), GAMEPAD_S)


OPERATOR_FAULTS = (
    Fault(estop_pressed_once_by_a_volatile_publisher),
    *killed_and_stopped(_hand, "teleop_killed", "teleop_hangs", about=FaultEnvironment(by_hand=True)),
)
