"""Goals from a page: what it sends as the message of the task's topic, until a controller has taken or refused it."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from geometry_msgs.msg import PointStamped, PoseStamped, TwistStamped
from nav_msgs.msg import Path
from rclpy.node import Node
from rclpy.publisher import Publisher

from fulmar_console.live.places import unplaced
from fulmar_console.live.robot_state import RobotState
from fulmar_console.source import Answer
from fulmar_core.robots.topics import GOAL_WIRES
from fulmar_core.wires import operator_action
from fulmar_core.wires.robot_name import Frames, frames_of, namespace_of
from fulmar_ros.convert import stamp_of
from fulmar_ros.operator_actions import OperatorActions
from fulmar_ros.qos import publisher_qos

GOAL_S = 3.0  # for a controller to take a goal, or refuse it [s]
KEPT_S = (
    2.0  # that a goal stays latched, for recorders; then no controller that comes later finds an old one [s]
)
SHORTEST = 1e-3  # of a quaternion that says something
NUMBERS = 7, 6  # of a pose, and of a twist
MOST_TARGETS = 1000
TWISTS = "goal_velocity"
KINDS: dict[str, type] = {
    "goal_velocity": TwistStamped,
    "goal_point": PointStamped,
    "goal_path": Path,
    "goal_pose": PoseStamped,
}


class GoalGiver:
    """Gives goals to one robot. Its publisher is there before it is needed, so that a goal arrives at once."""

    def __init__(self, node: Node, robot: RobotState) -> None:
        """Make publishers for the topic of the robot's task."""
        self._node, self._robot = node, robot
        self.topic = topic_of(robot)
        self._space = namespace_of(robot.name)
        self._actions = OperatorActions(node, self._space)
        self._publisher = self._new()
        self._said_s = 0.0  # when a goal was published last; 0: none is latched
        self._stamp_ns = 0

    def _new(self) -> Publisher:
        wire = GOAL_WIRES[self.topic]
        return self._node.create_publisher(
            KINDS[self.topic], f"{self._space}/{wire.name}", publisher_qos(wire)
        )

    def give(self, targets: Sequence[Sequence[float]], answer: Answer, by: str) -> GoalOrder | None:
        """Publish a goal; None where it was refused at once.

        Args:
            targets: Poses in `map`, or one twist in the body's frame.
            answer: Takes the result.
            by: Page that gives it.
        """
        robot = self._robot
        # By the robot's own clock; two goals between two of its messages differ all the same.
        stamp = max(robot.stamp_ns, self._stamp_ns + 1)
        moved = [unplaced(robot.origin, target) for target in targets]
        message = message_of(self.topic, moved, stamp, frames_of(robot.name, robot.type))
        if isinstance(message, str):
            answer(False, message)
            return None
        self._stamp_ns, self._said_s = stamp, time.monotonic()
        robot.see_giver(by, stamp)
        self._actions.say(operator_action.GOAL, stamp, by=by)
        self._publisher.publish(message)
        return GoalOrder(self._robot, stamp, answer)

    def look(self, now_s: float) -> None:
        """Forget a goal that has arrived."""
        if self._said_s and now_s - self._said_s > KEPT_S + GOAL_S:
            self._said_s = 0.0
            self._node.destroy_publisher(self._publisher)
            self._publisher = self._new()

    def destroy(self) -> None:
        """Destroy the publishers."""
        self._node.destroy_publisher(self._publisher)
        self._node.destroy_publisher(self._actions.publisher)


class GoalOrder:
    """A goal that was published, until the controller takes or refuses it."""

    def __init__(self, robot: RobotState, stamp_ns: int, answer: Answer) -> None:
        """Wait for the status that has this stamp."""
        self._robot, self._stamp, self._answer = robot, str(stamp_ns), answer
        self._began_s = time.monotonic()

    def step(self, now_s: float) -> bool:
        """Look at the controller's status."""
        values = self._robot.controller.values
        # A refusal stays in the status after its cause: only that of this very goal counts.
        if values.get("goal_refused") and values.get("goal_refused_stamp_ns") == self._stamp:
            self._answer(False, values["goal_refused"])
        elif values.get("goal_stamp_ns") == self._stamp:
            self._answer(True, "the controller follows it")
        elif now_s - self._began_s > GOAL_S:
            self._answer(False, f"no controller took it within {GOAL_S:g} s: is one running?")
        else:
            return False
        return True


def topic_of(robot: RobotState) -> str:
    """Where a robot's goals arrive."""
    topic = str((robot.info or {}).get("goal", {}).get("topic", "goal_pose"))
    return topic if topic in KINDS else "goal_pose"


def targets_of(command: Mapping[str, Any]) -> list[list[float]] | str:
    """Targets of a goal as a page sends it, or what is wrong with them."""
    targets = [command["velocity"]] if "velocity" in command else command.get("targets")
    if not isinstance(targets, list) or not 0 < len(targets) <= MOST_TARGETS:
        return f"a goal has 'velocity', or 1 to {MOST_TARGETS} 'targets'"
    for target in targets:
        numbers = isinstance(target, list) and all(type(each) in (int, float) for each in target)
        if not numbers or len(target) not in NUMBERS:
            return "a target has seven numbers, x y z and a quaternion, or six of a twist"
    try:
        return [[float(each) for each in target] for target in targets]
    except OverflowError:
        return "a target holds a number that is too large"


def message_of(topic: str, targets: Sequence[Sequence[float]], stamp_ns: int, frames: Frames) -> Any:
    """A goal as the message of its topic, or what is wrong with it.

    Args:
        topic: A key of `KINDS`.
        targets: Poses in `odom`, or one twist in `base_link`.
        stamp_ns: By the robot's own clock [ns].
        frames: Of the robot.
    """
    wanted = NUMBERS[1] if topic == TWISTS else NUMBERS[0]
    if any(len(target) != wanted for target in targets):
        return f"a goal on {topic} has {wanted} numbers"
    if topic != "goal_path" and len(targets) != 1:
        return f"a goal on {topic} has one target, not {len(targets)}"
    message = KINDS[topic]()
    message.header.stamp = stamp_of(stamp_ns)
    message.header.frame_id = frames.base if topic == TWISTS else frames.odom
    if topic == TWISTS:
        v, w = message.twist.linear, message.twist.angular
        v.x, v.y, v.z, w.x, w.y, w.z = targets[0]
    elif topic == "goal_point":
        message.point.x, message.point.y, message.point.z = targets[0][:3]
    elif topic == "goal_path":
        poses = [message_of("goal_pose", [target], stamp_ns, frames) for target in targets]
        wrong = next((pose for pose in poses if isinstance(pose, str)), None)
        if wrong is not None:
            return wrong
        message.poses = poses
    else:
        quat = np.array(targets[0][3:])
        length = float(np.linalg.norm(quat))
        if length < SHORTEST:
            return "an attitude is a quaternion x y z w that is not zero"
        p, q = message.pose.position, message.pose.orientation
        p.x, p.y, p.z = targets[0][:3]
        q.x, q.y, q.z, q.w = (quat / length).tolist()
    return message
