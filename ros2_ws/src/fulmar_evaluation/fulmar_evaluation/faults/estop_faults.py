"""An e-stop that is pressed by a node that is no e-stop node, with default quality of service."""

from __future__ import annotations

import rclpy
from std_msgs.msg import Bool

from fulmar_core.errors import RunFailed
from fulmar_core.topics import ESTOP
from fulmar_evaluation.faults.fault import Fault
from fulmar_evaluation.faults.fault_result import STAYS_S, Outcome, stopped
from fulmar_evaluation.faults.live_system import LiveSystem
from fulmar_evaluation.faults.observer import wait_for

DEFAULT_QOS = 10  # a depth alone: reliable and volatile
NODES = 4  # plant, controller, e-stop node and recorder subscribe the e-stop
MATCH_S = 10.0


def estop_pressed_once_by_a_volatile_publisher(live: LiveSystem) -> Outcome:
    """One message; the e-stop node, which goes on publishing, must not end it."""
    node = rclpy.create_node("stranger", namespace=live.plan.namespace)
    try:
        publisher = node.create_publisher(Bool, ESTOP.name, DEFAULT_QOS)
        # A volatile publisher matches one of the two subscriptions of each node.
        if not wait_for(lambda: publisher.get_subscription_count() >= NODES, MATCH_S):
            raise RunFailed(f"fewer than {NODES} nodes subscribe {publisher.topic_name} within {MATCH_S:g} s")
        since_s = live.until_it_moves()
        # The very next tick may be safe: a state that still moves the robot must be on record, at most two ticks old.
        wait_for(lambda: any(moves for _, moves in live.witness.applied_since(since_s)), STAYS_S)
        publisher.publish(Bool(data=True))
        return stopped(live, since_s, live.silenced_s)
    finally:
        node.destroy_node()


ESTOP_FAULTS = (Fault(estop_pressed_once_by_a_volatile_publisher),)
