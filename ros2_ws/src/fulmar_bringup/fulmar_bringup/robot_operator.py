"""A person's side of a system that runs already: asks its services, from a process of its own."""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Iterator, Sequence

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future
from std_msgs.msg import String
from std_srvs.srv import Trigger

from fulmar_bringup.reset_robots import release_without_node, robots_to_reset
from fulmar_bringup.running_robots import running_robots, unfit_publishers
from fulmar_bringup.stop_robots import ANSWER_S, Answer, Stopped, spaces_with, stop_robots
from fulmar_core.errors import RunFailed
from fulmar_core.topics import ESTOP_RESET, STATUS, SWAP
from fulmar_ros.middleware import set_up_middleware
from fulmar_ros.qos import publisher_qos, subscriber_qos
from fulmar_ros.runtime import spinning

FIND_S = 7.0  # whose first announcements are lost announces himself again after 3 s
LOOK_S, SETTLE_S, ASK_S = 0.05, 0.3, 0.005


class Operator:
    """Finds robots by what they offer, and asks."""

    def __init__(self, node: Node) -> None:
        """Ask through a node that spins already."""
        self._node = node

    def robots_with(self, service: str, robot: str | None, *, wait_s: float) -> list[str]:
        """Namespaces that offer a service, as soon as one does; only that of one robot, if it is named."""
        until = time.monotonic() + wait_s
        while True:
            found = spaces_with(self._node, service)
            if robot is not None:
                found &= {f"/{robot}"}
            if time.monotonic() > until or (found and robot is not None):
                return sorted(found)
            if found:  # who is found first is rarely alone: the others get a moment
                until = min(until, time.monotonic() + SETTLE_S)
            time.sleep(LOOK_S)

    def ask(self, service: str) -> tuple[bool, str]:
        """Call a Trigger service by its full name.

        Returns:
            Whether it was done, and what was said.

        Raises:
            RunFailed: No answer comes.
        """
        answer = self.ask_all([service])[service]
        if answer is None:
            raise RunFailed(f"nobody answers on {service} within {ANSWER_S:g} s.")
        return answer

    def ask_all(self, services: Sequence[str]) -> dict[str, Answer | None]:
        """Call Trigger services by their full names, all at once.

        Args:
            services: Which.

        Returns:
            What each said; None where no answer comes within 2 s.
        """
        clients = {service: self._node.create_client(Trigger, service) for service in services}
        futures: dict[str, Future] = {}
        until = time.monotonic() + ANSWER_S
        while True:
            for name, client in clients.items():
                if name not in futures and client.service_is_ready():
                    futures[name] = client.call_async(Trigger.Request())
            answered = all(name in futures and futures[name].done() for name in clients)
            if answered or time.monotonic() > until:
                break
            time.sleep(ASK_S)
        said = {name: future.result() for name, future in futures.items() if future.done()}
        return {name: (said[name].success, said[name].message) if name in said else None for name in clients}

    def stop_all(self, robot: str | None) -> list[Stopped]:
        """Stop every robot, or one; see `stop_robots`."""
        return stop_robots(self._node, robot, find_s=FIND_S)

    def reset_all(self, robot: str | None) -> dict[str, Answer]:
        """Reset the e-stop of every robot, or of one, by namespace; see `reset_robots`."""
        with_node, without = robots_to_reset(self._node, robot, find_s=FIND_S)
        services = {space: f"{space}/{ESTOP_RESET}" for space in sorted(with_node)}
        said = self.ask_all(list(services.values()))
        came = {
            space: said[name] or (False, "its e-stop node does not answer")
            for space, name in services.items()
        }
        return came | {space: release_without_node(self._node, space) for space in sorted(without)}

    def look_at_wires(self) -> tuple[set[str], list[str]]:
        """Namespaces of the robots that run here, and publishers on their wires from which nothing arrives."""
        spaces = running_robots(self._node)
        return spaces, unfit_publishers(self._node, spaces)

    def say_swap(self, robot: str, folder: str, *, find_s: float) -> dict[str, str]:
        """Ask a controller to go on with another policy.

        Args:
            robot: Whose controller.
            folder: The bundle, on the robot's own disk.
            find_s: How long to look for the controller [s].

        Returns:
            What the controller says of itself from then on; `swap` tells what came of it.

        Raises:
            RunFailed: There is no controller.
        """
        status: dict[str, str] = {}

        def hear(message: DiagnosticArray) -> None:
            values = {pair.key: pair.value for pair in message.status[0].values} if message.status else {}
            if folder in values.get("swap", ""):
                status.update(values)

        publisher = self._node.create_publisher(String, f"/{robot}/{SWAP.name}", publisher_qos(SWAP))
        until = time.monotonic() + find_s
        while not publisher.get_subscription_count():
            if time.monotonic() > until:
                raise RunFailed(f"no controller of '{robot}' is heard in this ROS domain.")
            time.sleep(LOOK_S)
        time.sleep(SETTLE_S)  # a match is seen here a moment before the other side is ready
        publisher.publish(String(data=folder))
        publisher.wait_for_all_acked(Duration(seconds=ANSWER_S))
        time.sleep(SETTLE_S)  # what it says from now on is about this request
        qos = subscriber_qos(STATUS, reliable=True)
        self._node.create_subscription(DiagnosticArray, f"/{robot}/{STATUS.name}", hear, qos)
        return status


@contextlib.contextmanager
def operator() -> Iterator[Operator]:
    """An operator whose node spins until the context ends."""
    set_up_middleware()
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
    errors: list[Exception] = []
    node = rclpy.create_node(f"operator_{os.getpid()}")
    try:
        with spinning(node, errors.append):
            yield Operator(node)
    finally:
        rclpy.try_shutdown()
