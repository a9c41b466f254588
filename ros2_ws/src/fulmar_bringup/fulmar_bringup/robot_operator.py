"""A person's side of a system that runs already: finds robots, asks their services, looks at their wires."""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Iterator, Sequence

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.node import Node
from rclpy.task import Future
from std_msgs.msg import String
from std_srvs.srv import Trigger

from fulmar_bringup.estop_robots import (
    ANSWER_S,
    Answer,
    Stopped,
    release_without_node,
    robots_to_reset,
    spaces_with,
    stop_robots,
)
from fulmar_core.config.errors import RunFailed
from fulmar_core.robots.topics import ESTOP_RESET, STATUS, SWAP, WIRES, Wire
from fulmar_core.robots.wire_check import wire_problems
from fulmar_core.wires.robot_name import namespace_of
from fulmar_ros.graph import full_name, offers_of, robot_namespaces, running_robots_text
from fulmar_ros.operator_subscription import subscribe_every
from fulmar_ros.qos import publisher_qos
from fulmar_ros.runtime import ros_node

DISCOVER_S = 1.5  # until the nodes of the domain have found this one


def running_robots(node: Node, *, find_s: float = DISCOVER_S) -> set[str]:
    """Namespaces with a plant or a controller, after some time to find them."""
    time.sleep(find_s)
    return robot_namespaces(node)


def unfit_publishers(node: Node, spaces: set[str]) -> list[str]:
    """Publishers on the wires of robots from which nothing arrives, one sentence each."""
    return [
        problem
        for space in sorted(spaces)
        for wire in WIRES
        if not wire.name.startswith("/")
        for problem in _of_wire(node, wire, f"{space.rstrip('/')}/{wire.name}")
    ]


def _of_wire(node: Node, wire: Wire, topic: str) -> list[str]:
    """Best effort is no problem here: who refuses it in lock step says so itself."""
    return wire_problems(wire, topic, offers_of(node, topic), reliable=False)


FIND_S = 7.0  # a node whose first announcements are lost announces itself again after 3 s
LOOK_S, SETTLE_S, ASK_S = 0.05, 0.3, 0.005
ASK_AGAIN_S = 0.5  # a controller says at once that it has a request


class Operator:
    """Finds robots by their services, and calls these."""

    def __init__(self, node: Node) -> None:
        """Call through a node that spins already."""
        self._node = node

    def robots_with(self, service: str, robot: str | None, *, wait_s: float) -> list[str]:
        """Namespaces that offer a service, as soon as one does; only that of one robot, if it is named."""
        until = time.monotonic() + wait_s
        while True:
            found = spaces_with(self._node, service)
            if robot is not None:
                found &= {namespace_of(robot)}
            if time.monotonic() > until or (found and robot is not None):
                return sorted(found)
            if found:  # the first one is rarely alone: the others get a moment
                until = min(until, time.monotonic() + SETTLE_S)
            time.sleep(LOOK_S)

    def ask(self, service: str) -> tuple[bool, str]:
        """Call a Trigger service by its full name; raises RunFailed where no answer comes."""
        answer = self.ask_all([service])[service]
        if answer is None:
            raise RunFailed(f"no node answers on {service} within {ANSWER_S:g} s.")
        return answer

    def ask_all(self, services: Sequence[str]) -> dict[str, Answer | None]:
        """Call Trigger services by their full names, all at once; None where no answer comes within 2 s."""
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
        answers = {name: future.result() for name, future in futures.items() if future.done()}
        return {
            name: (answers[name].success, answers[name].message) if name in answers else None
            for name in clients
        }

    def stop_all(self, robot: str | None) -> list[Stopped]:
        """Stop every robot, or one; see `stop_robots`."""
        return stop_robots(self._node, robot, find_s=FIND_S)

    def reset_all(self, robot: str | None) -> dict[str, Answer]:
        """Reset the e-stop of every robot, or of one, by namespace; see `robots_to_reset`."""
        with_node, without = robots_to_reset(self._node, robot, find_s=FIND_S)
        services = {space: f"{space}/{ESTOP_RESET}" for space in sorted(with_node)}
        answers = self.ask_all(list(services.values()))
        came = {
            space: answers[name] or (False, "its e-stop node does not answer")
            for space, name in services.items()
        }
        return came | {space: release_without_node(self._node, space) for space in sorted(without)}

    def running_robots_text(self) -> str:
        """A sentence that lists the robots that run now."""
        return running_robots_text(self._node)

    def look_at_wires(self) -> tuple[set[str], list[str]]:
        """Namespaces of the robots that run here, and publishers on their wires from which nothing arrives."""
        spaces = running_robots(self._node)
        return spaces, unfit_publishers(self._node, spaces)

    def say_swap(self, robot: str, folder: str, *, find_s: float, answer_s: float) -> str:
        """Ask a controller to go on with another policy, and again until its status answers this very request.

        A recorder subscribes to the same topic, so that a subscription alone shows no controller. The first request
        gets lost where discovery has not matched it with the controller yet.

        Args:
            robot: Name of the robot whose controller it is.
            folder: The bundle, on the robot's own disk.
            find_s: How long to look for the controller [s].
            answer_s: How long the policy may take to take over [s].

        Returns:
            What came of it: a text that begins with `done` or `refused`.

        Raises:
            RunFailed: There is no controller, or it does not answer.
        """
        status: dict[str, str] = {}

        def read(message: DiagnosticArray) -> None:
            if message.status:
                status.update({pair.key: pair.value for pair in message.status[0].values})

        space = namespace_of(robot)
        subscribe_every(self._node, DiagnosticArray, STATUS, read, topic=f"{space}/{STATUS.name}")
        publisher = self._node.create_publisher(String, f"{space}/{SWAP.name}", publisher_qos(SWAP))
        until = time.monotonic() + find_s
        while not (status and self._takes_swaps(space)):
            if time.monotonic() > until:
                raise RunFailed(
                    f"no controller of '{robot}' runs in this ROS domain. {self.running_robots_text()}"
                )
            time.sleep(LOOK_S)
        before, until, asked_s = status.get("swap_requests"), time.monotonic() + answer_s, 0.0
        while True:
            swap, now_s = status.get("swap", ""), time.monotonic()
            taken = status.get("swap_requests") != before and folder in swap
            if taken and swap.startswith(("done", "refused")):
                return swap
            if now_s > until:
                raise RunFailed(f"the controller of '{robot}' did not answer within {answer_s:g} s.")
            if not taken and now_s - asked_s > ASK_AGAIN_S:
                publisher.publish(String(data=folder))
                asked_s = now_s
            time.sleep(ASK_S)

    def _takes_swaps(self, space: str) -> bool:
        """Whether a node that publishes the status of a controller subscribes to requests, too."""
        asked = self._node.get_subscriptions_info_by_topic(f"{space}/{SWAP.name}")
        answering = self._node.get_publishers_info_by_topic(f"{space}/{STATUS.name}")
        return bool({full_name(info) for info in asked} & {full_name(info) for info in answering})


@contextlib.contextmanager
def operator() -> Iterator[Operator]:
    """An operator whose node spins until the context ends."""
    errors: list[Exception] = []
    with ros_node(f"operator_{os.getpid()}", errors.append) as node:
        try:
            yield Operator(node)
        except RunFailed as failed:
            if errors:
                raise RunFailed(f"the operator's node failed: {errors[0]!r}") from errors[0]
            raise failed
