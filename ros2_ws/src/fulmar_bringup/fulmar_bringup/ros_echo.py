"""One message to oneself over DDS, to see that ROS works."""

from __future__ import annotations

import threading
import time

import numpy as np
from std_msgs.msg import String

from fulmar_core.robots.topics import METADATA
from fulmar_ros.qos import publisher_qos, subscriber_qos
from fulmar_ros.runtime import ros_node

ROUNDS = 20


def round_trip_ms(timeout_s: float = 5.0) -> float | None:
    """Median time from publishing to the callback.

    Args:
        timeout_s: Longest wait for one message [s].

    Returns:
        Time [ms], or None if a message did not come.
    """
    received, times = threading.Event(), []
    with ros_node("doctor", lambda _error: None, namespace="/fulmar_doctor") as node:
        node.create_subscription(String, "echo", lambda _message: received.set(), subscriber_qos(METADATA))
        publisher = node.create_publisher(String, "echo", publisher_qos(METADATA))
        for number in range(ROUNDS):
            received.clear()
            began = time.monotonic()
            publisher.publish(String(data=str(number)))
            if not received.wait(timeout_s):
                return None
            times.append(1000.0 * (time.monotonic() - began))
    return float(np.median(times))
