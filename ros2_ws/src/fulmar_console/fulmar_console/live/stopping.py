"""The e-stop of the page: pressed at once, from any thread, and again until the plant says that it is stopped."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping
from typing import Any

from rclpy.client import Client
from rclpy.node import Node
from rclpy.publisher import Publisher
from std_msgs.msg import Bool
from std_srvs.srv import Trigger

from fulmar_console.live.robot_state import RobotState
from fulmar_console.source import Answer
from fulmar_core.robots.topics import ESTOP, ESTOP_TRIGGER
from fulmar_core.wires import operator_action
from fulmar_core.wires.robot_name import namespace_of
from fulmar_ros.operator_actions import OperatorActions
from fulmar_ros.qos import publisher_qos

SAY_S = 0.05  # between two presses of an e-stop that is not confirmed [s]
PRESS_S = 10.0  # for which one is pressed [s]
CONFIRM_S = 0.5  # after which a person is told that it is not confirmed [s]
ASKED_S = 1.0  # after which an e-stop node that does not answer is asked again [s]
NOT_CONFIRMED = "NOT CONFIRMED: use the button at the robot"


class StopButton:
    """The e-stop of one robot: publishers and a client that are there before they are needed."""

    def __init__(self, node: Node, name: str) -> None:
        """Make them."""
        space = namespace_of(name)
        self._node, self._topic = node, f"{space}/{ESTOP.name}"
        self._wire: Publisher = node.create_publisher(Bool, self._topic, publisher_qos(ESTOP))
        self._actions = OperatorActions(node, space)
        self._trigger: Client = node.create_client(Trigger, f"{space}/{ESTOP_TRIGGER}")
        self._lock = threading.Lock()
        self._was_stopped = self._pressed = False
        self._asked: Any = None
        self._asked_s = 0.0

    def press(self, by: str) -> None:
        """Say it on the wire, and ask the node, which goes on saying it; from any thread."""
        with self._lock:
            if not self._pressed:
                self._actions.say(operator_action.ESTOP, by=by)
            self._pressed = True
            self._wire.publish(Bool(data=True))
            self._ask(time.monotonic())

    def _ask(self, now_s: float) -> None:
        if self._asked is not None and not self._asked.done():
            if now_s - self._asked_s < ASKED_S:
                return
            self._trigger.remove_pending_request(self._asked)  # the node hangs
        if self._trigger.service_is_ready():
            self._asked, self._asked_s = self._trigger.call_async(Trigger.Request()), now_s

    def see(self, stopped: bool) -> None:
        """Forget the press once the robot was released: a plant that starts later must not find it latched here."""
        with self._lock:
            if self._was_stopped and not stopped and self._pressed:
                self._node.destroy_publisher(self._wire)
                self._wire = self._node.create_publisher(Bool, self._topic, publisher_qos(ESTOP))
                self._pressed = False
            self._was_stopped = stopped


class Stop:
    """Presses e-stops until every plant says that it is stopped."""

    def __init__(
        self,
        names: Callable[[], list[str]],
        press: Callable[[str], None],
        robots: Mapping[str, RobotState],
        answer: Answer,
        began_s: float,
    ) -> None:
        """Go on with what has been pressed.

        Args:
            names: Of the robots to stop: where all are asked for, those too that are found meanwhile.
            press: Presses that of a robot.
            robots: What is known of them.
            answer: Takes the result, or after half a second that it is missing.
            began_s: When it was pressed first, by the monotonic clock [s].
        """
        self._names, self._press, self._robots, self._answer = names, press, robots, answer
        self._began_s, self._said_s, self._answered = began_s, 0.0, False

    def step(self, now_s: float) -> bool:
        """Press again what is not confirmed."""
        names = self._names()
        missing = [name for name in names if not self._confirmed(name)]
        if missing and now_s - self._said_s > SAY_S:
            self._said_s = now_s
            for name in missing:
                self._press(name)
        if names and not missing:
            self._say(True, "stopped")
        elif now_s - self._began_s > CONFIRM_S:
            whom = f" ({', '.join(missing)})" if missing else ": no robot is known"
            self._say(False, f"{NOT_CONFIRMED}{whom}")
        return bool(names and not missing) or now_s - self._began_s > PRESS_S

    def _say(self, stopped: bool, words: str) -> None:
        if not self._answered:
            self._answered = True
            self._answer(stopped, words)

    def _confirmed(self, name: str) -> bool:
        """Whether the plant has said since the press that it is stopped.

        One that had said so before says it again once a second; that it still sends at all is enough then.
        """
        robot = self._robots.get(name)
        if robot is None or not robot.estopped or robot.plant.silent:
            return False
        return robot.plant.received_s > self._began_s or (robot.applied_s > self._began_s and not robot.moves)
