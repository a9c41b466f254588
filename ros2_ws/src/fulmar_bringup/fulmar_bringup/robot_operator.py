"""A person's side of a system that runs already: finds robots, asks their services, looks at their wires."""

from __future__ import annotations

import contextlib
import os
import time
import uuid
from collections.abc import Callable, Iterator, Sequence
from typing import TypeVar

from rclpy.node import Node
from rclpy.task import Future
from std_msgs.msg import String
from std_srvs.srv import SetBool, Trigger

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
from fulmar_core.loop.swap_request import SwapRequest, SwapResult, read_result
from fulmar_core.robots.topics import ESTOP_RESET, SWAP, SWAP_RESULT, WIRES, Wire
from fulmar_core.robots.wire_check import wire_problems
from fulmar_core.wires.robot_name import namespace_of
from fulmar_ros.graph import full_name, offers_of, robot_namespaces, running_robots_text
from fulmar_ros.operator_actions import who
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
Result = TypeVar("Result")
ASK_AGAIN_S = 0.5  # a request that is being loaded is not loaded again


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

    def ask(self, service: str, *, on: bool | None = None) -> tuple[bool, str]:
        """Call a service by its full name, as `ask_all`; raises RunFailed where no answer comes."""
        answer = self.ask_all([service], on=on)[service]
        if answer is None:
            raise RunFailed(f"no node answers on {service} within {ANSWER_S:g} s.")
        return answer

    def ask_all(self, services: Sequence[str], *, on: bool | None = None) -> dict[str, Answer | None]:
        """Call services by their full names, all at once; None where no answer comes within 2 s.

        Args:
            services: Of type Trigger; of type SetBool where `on` is given.
            on: What a SetBool is called with.
        """
        kind, request = (Trigger, Trigger.Request()) if on is None else (SetBool, SetBool.Request(data=on))
        clients = {service: self._node.create_client(kind, service) for service in services}
        futures: dict[str, Future] = {}
        until = time.monotonic() + ANSWER_S
        while True:
            for name, client in clients.items():
                if name not in futures and client.service_is_ready():
                    futures[name] = client.call_async(request)
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

    def ask_swap(
        self, robot: str, *, controller: str = "", bundle: str = "", find_s: float, answer_s: float
    ) -> SwapResult:
        """Ask a robot's controller node to go on with another controller, and again until it answers this request.

        Args:
            robot: Name of the robot.
            controller: Name of a controller, of those in its `robot_info`; empty: the policy of `bundle`.
            bundle: Folder of a policy, on the robot's own disk.
            find_s: How long to look for the controller node [s].
            answer_s: How long the controller may take to take over [s].

        Returns:
            The answer.

        Raises:
            RunFailed: There is no controller node, or it does not answer.
        """
        request = SwapRequest("", uuid.uuid4().hex, controller, bundle, who(self._node))
        return self.ask_on_wire(
            robot,
            (SWAP, SWAP_RESULT),
            request.to_text(),
            lambda text: found if (found := read_result(text)) and found.id == request.id else None,
            "controller",
            find_s=find_s,
            answer_s=answer_s,
        )

    def ask_on_wire(
        self,
        robot: str,
        wires: tuple[Wire, Wire],
        text: str,
        read: Callable[[str], Result | None],
        who_answers: str,
        *,
        find_s: float,
        answer_s: float,
    ) -> Result:
        """Publish a request to a robot, again and again, until its answer comes.

        A recorder subscribes to the same topic, so that a subscription alone shows no one who answers. The first
        request gets lost where discovery has not matched it yet; one that is repeated with the same id is done once.

        Args:
            robot: Name of the robot.
            wires: Of request and answer.
            text: The request.
            read: The answer to this request in a text, or None.
            who_answers: In words, for errors.
            find_s: How long to look for who answers [s].
            answer_s: How long it may take [s].

        Raises:
            RunFailed: Nothing takes such requests, or the answer does not come.
        """
        answers: list[Result] = []
        space = namespace_of(robot)
        asked, answered = (f"{space}/{wire.name}" for wire in wires)

        def take(message: String) -> None:
            if (result := read(message.data)) is not None:
                answers.append(result)

        subscribe_every(self._node, String, wires[1], take, topic=answered)
        publisher = self._node.create_publisher(String, asked, publisher_qos(wires[0]))
        until = time.monotonic() + find_s
        while not self._takes(asked, answered):
            if time.monotonic() > until:
                raise RunFailed(
                    f"no {who_answers} of '{robot}' runs in this ROS domain. {self.running_robots_text()}"
                )
            time.sleep(LOOK_S)
        until, asked_s = time.monotonic() + answer_s, 0.0
        while not answers:
            now_s = time.monotonic()
            if now_s > until:
                raise RunFailed(f"the {who_answers} of '{robot}' did not answer within {answer_s:g} s.")
            if now_s - asked_s > ASK_AGAIN_S:
                publisher.publish(String(data=text))
                asked_s = now_s
            time.sleep(ASK_S)
        return answers[0]

    def _takes(self, asked: str, answered: str) -> bool:
        """Whether a node that answers requests subscribes to them, too."""
        takes = self._node.get_subscriptions_info_by_topic(asked)
        answers = self._node.get_publishers_info_by_topic(answered)
        return bool({full_name(info) for info in takes} & {full_name(info) for info in answers})


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
