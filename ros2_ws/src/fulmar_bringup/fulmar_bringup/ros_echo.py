"""One message to oneself over DDS, to see that ROS works."""

from __future__ import annotations

import threading
import time

import numpy as np
import rclpy
from rclpy.signals import SignalHandlerOptions
from std_msgs.msg import String

from fulmar_core.topics import METADATA
from fulmar_ros.middleware import set_up_middleware
from fulmar_ros.qos import publisher_qos, subscriber_qos
from fulmar_ros.runtime import spinning

ROUNDS = 20


def round_trip_ms(timeout_s: float = 5.0) -> float | None:
    """Median time from publishing to the callback.

    Args:
        timeout_s: Longest wait for one message [s].

    Returns:
        Time [ms], or None if a message did not come.
    """
    set_up_middleware()
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
    try:
        node = rclpy.create_node("doctor", namespace="/fulmar_doctor")
        heard = threading.Event()
        node.create_subscription(String, "echo", lambda _message: heard.set(), subscriber_qos(METADATA))
        publisher = node.create_publisher(String, "echo", publisher_qos(METADATA))
        times = []
        with spinning(node, lambda _error: None):
            for number in range(ROUNDS):
                heard.clear()
                began = time.monotonic()
                publisher.publish(String(data=str(number)))
                if not heard.wait(timeout_s):
                    return None
                times.append(1000.0 * (time.monotonic() - began))
        return float(np.median(times))
    finally:
        rclpy.try_shutdown()
