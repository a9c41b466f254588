"""A person who drives a robot from a page: the page is the dead-man switch."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from rclpy.node import Node
from sensor_msgs.msg import JointState

from fulmar_console.live.robot_state import RobotState
from fulmar_core.config.errors import ConfigError
from fulmar_core.loop.teleop import NOTHING, Wish, hand_mapping
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import TELEOP
from fulmar_core.wires.robot_name import namespace_of
from fulmar_ros.convert import VectorWriter
from fulmar_ros.qos import publisher_qos

HOLDS_S = 0.3  # after which a page that says nothing has let go [s]
PERIOD_S = 0.05  # between two commands [s]
SHARE = 0.5  # of what the robot can, at full wish, as `fulmar teleop` has it
LAST_WORDS_S = 1.0  # for which the safe command is sent once the page has gone [s]
TAKEN_S = 1.5  # by which a plant has said that a person has it [s]
BY_PERSON = "person"  # of `commanded_by` in a plant's diagnostics


@dataclass(frozen=True)
class HandMapping:
    """From wishes of a person to commands of a type of robot."""

    names: tuple[str, ...]
    command: Callable[[Wish], np.ndarray]


def mapping_of(kind: str) -> HandMapping:
    """For a type of robot; takes a moment.

    Raises:
        ConfigError: A person cannot drive it, or its file is not on this computer.
    """
    robot = load_robot(kind)
    command, share = hand_mapping(robot), 1.0 if robot.actuators.binary else SHARE
    return HandMapping(tuple(robot.actuators.names), lambda wish: share * command(wish))


class Hand:
    """Commands of one person for one robot, in the executor's thread.

    From the first wish on it sends, and goes on with the safe command once the person lets go: the controller gets the
    robot back when a person says so, as with `fulmar teleop`. Once the page has gone it falls silent.
    """

    def __init__(self, node: Node, robot: RobotState, mapping: HandMapping) -> None:
        """Make the publisher."""
        self._robot, self._command = robot, mapping.command
        self._writer = VectorWriter(mapping.names)
        topic = f"{namespace_of(robot.name)}/{TELEOP.name}"
        self._publisher = node.create_publisher(JointState, topic, publisher_qos(TELEOP))
        self._wish, self._wished_s, self._sent_s, self._gone_s = NOTHING, -math.inf, 0.0, math.inf
        self.owner = ""  # page that drives; empty: none

    def drive(self, client: str, wish: Wish | None, now_s: float) -> str:
        """Take a wish of a page, None if it lets go; returns why not, empty if it is taken."""
        if self.owner not in ("", client) and now_s - self._wished_s < HOLDS_S:
            return f"{self.owner} drives it"
        if wish is None:
            self._wish = NOTHING
            return ""
        self.owner, self._wish, self._wished_s, self._gone_s = client, wish, now_s, math.inf
        return ""

    def forget(self, client: str, now_s: float) -> None:
        """The page has gone."""
        if self.owner == client:
            self._wish, self._gone_s = NOTHING, now_s

    def give_back(self) -> None:
        """The controller has the robot again: send no more."""
        self.owner = ""

    def send(self, now_s: float) -> None:
        """The command that is due, if any."""
        silent_s = now_s - self._wished_s
        if not self.owner or now_s - self._sent_s < PERIOD_S:
            return
        given_back = silent_s > TAKEN_S and self._robot.plant.values.get("commanded_by") != BY_PERSON
        if given_back or now_s - self._gone_s > LAST_WORDS_S:
            self.owner = ""
            return
        self._sent_s = now_s
        wish = self._wish if silent_s < HOLDS_S else NOTHING
        self._publisher.publish(self._writer.write(self._command(wish), 0))

    def destroy(self, node: Node) -> None:
        """Destroy the publisher."""
        node.destroy_publisher(self._publisher)


def wish_of(command: Mapping[str, Any]) -> Wish | str | None:
    """What a page wishes; None if it lets go, and what is wrong with a command that is none."""
    share = command["share"]
    numbers = list(share) if isinstance(share, list) else []
    fits = all(type(each) in (int, float) and abs(each) < math.inf for each in numbers)
    if len(numbers) != len(NOTHING.parts) or not fits:
        return f"teleoperation takes {len(NOTHING.parts)} finite numbers from -1 to 1: ahead, left, turn"
    if command.get("deadman", True) is not True:
        return None
    ahead, left, turn = (max(-1.0, min(1.0, float(number))) for number in numbers)
    return Wish(ahead, left, turn)


def mapping_or_problem(kind: str) -> tuple[HandMapping | None, str]:
    """The mapping of a type, or None and why there is none."""
    try:
        return mapping_of(kind), ""
    except ConfigError as error:
        return None, str(error)
