"""The node `markers`: draws goal, limits, obstacles, thrust and body of one robot for RViz and Foxglove.

No other node needs it or waits for it: nothing that moves the robot depends on what is drawn.
"""

from __future__ import annotations

import os
import sys
import time
from dataclasses import dataclass

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from sensor_msgs.msg import JointState
from visualization_msgs.msg import MarkerArray

from fulmar_bags.message_reader import goal_of, obstacles_of, stamp_ns
from fulmar_core.config.yielding import BEHIND
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import (
    ACTUATORS_STATE,
    DIAGNOSTICS,
    MARKERS,
    OBSTACLES,
    STATUS,
    goal_wires,
)
from fulmar_core.safety.geofence import NO_AREA, check_area, check_area_of
from fulmar_core.tasks import load_task
from fulmar_ros.goal_messages import TYPES, GoalMessage
from fulmar_ros.health import Health
from fulmar_ros.marker_messages import scene_message
from fulmar_ros.operator_subscription import LateSubscribers, subscribe_every
from fulmar_ros.parameters import name_of, own_frames, read_parameters
from fulmar_ros.qos import publisher_qos, subscriber_qos
from fulmar_ros.relay import Relay
from fulmar_ros.runtime import RequestExit, run_node
from fulmar_ros.scene.scene import Scene

PERIOD_S = 0.1  # of a look for changes: at most 10 messages a second
HEALTH_S = 1.0
SILENT_S = 1.0  # a plant that publishes nothing for so long: what its actuators do is not known
NOT_YET = ("inactive", "waiting")  # modes of a plant that waits for its subscribers


@dataclass(frozen=True)
class MarkersSettings:
    """ROS parameters of the markers node."""

    robot: str = "floating_platform"
    task: str = "go_to_pose"
    thing: str = ""  # in space, in the place of that of the task; empty: as the task has it
    area: tuple[float, ...] = NO_AREA  # as in `Guards.area` [m]

    def __post_init__(self) -> None:
        """Refuse an area that is none."""
        if self.area != NO_AREA:
            check_area(self.area)


class MarkersNode(Node):
    """Publishes the whole scene where it changed, ten times a second at most."""

    def __init__(self, _request_exit: RequestExit, *, cli_args: list[str] | None = None) -> None:
        """Wait for the plant, and draw the body meanwhile.

        Args:
            cli_args: ROS arguments of this node alone, where it shares a process.

        Raises:
            FulmarError: If a parameter or a file is wrong.
        """
        super().__init__("markers", cli_args=cli_args)
        settings = read_parameters(self, MarkersSettings)
        robot, task = load_robot(settings.robot), load_task(settings.task, settings.thing)
        task.check_running(robot)
        check_area_of(robot, settings.area)
        self._name, self._frames = name_of(self, robot), own_frames(self, robot)
        self._topic = task.goal_topic
        self._scene = Scene(robot, task, settings.area)
        self._received_s = self._reported_s = 0.0
        self._problem = ""
        self._message: MarkerArray | None = None
        self._publisher = self.create_publisher(MarkerArray, MARKERS.name, publisher_qos(MARKERS))
        # RViz asks for volatile messages unless it is configured otherwise, and may start after the goal was given.
        LateSubscribers(self, self._publisher, lambda: [self._message] if self._message else [])
        self._health = Health(self, f"{self._name}: markers")
        # Plant, controller and operators count subscribers before they begin. This one subscribes their topics once
        # the plant runs, so that it never stands for one that they need.
        self._is_subscribed = False
        self.create_subscription(
            DiagnosticArray, DIAGNOSTICS.name, self._on_diagnostics, subscriber_qos(DIAGNOSTICS, depth=10)
        )
        self.create_timer(PERIOD_S, self._draw, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            if status.name == f"{self._name}: plant" and not self._is_subscribed:
                mode = next((pair.value for pair in status.values if pair.key == "mode"), NOT_YET[0])
                if mode not in NOT_YET:
                    self._is_subscribed = True
                    self._subscribe()

    def _subscribe(self) -> None:
        relay = Relay(self)
        for wire in goal_wires(self._topic):
            receive = relay.relaying(wire, self._on_goal)
            subscribe_every(self, TYPES[wire.name], wire, receive, with_info=True)
        receive = relay.relaying(OBSTACLES, self._on_obstacles)
        subscribe_every(self, MarkerArray, OBSTACLES, receive, with_info=True)
        applied = subscriber_qos(ACTUATORS_STATE, depth=10)
        self.create_subscription(JointState, ACTUATORS_STATE.name, self._on_applied, applied)
        subscribe_every(self, DiagnosticArray, STATUS, self._on_status)

    def _on_goal(self, message: GoalMessage, _info: dict[str, int]) -> None:
        targets, self._problem = goal_of(message, self._frames)
        if targets is not None:  # what is no goal is not drawn: the controller refuses it, too
            self._scene.give_goal(targets, stamp_ns(message.header.stamp))

    def _on_obstacles(self, message: MarkerArray, _info: dict[str, int]) -> None:
        obstacles, self._problem = obstacles_of(message, self._frames)
        if obstacles is not None:
            self._scene.give_obstacles(obstacles)

    def _on_status(self, message: DiagnosticArray) -> None:
        if message.status:
            self._scene.give_status({pair.key: pair.value for pair in message.status[0].values})

    def _on_applied(self, message: JointState) -> None:
        self._received_s = time.monotonic()
        self._scene.give_applied(message.name, message.effort)

    def _draw(self) -> None:
        now = time.monotonic()
        if now - self._received_s > SILENT_S:
            self._scene.forget_applied()
        change = self._scene.change()
        if change is not None:
            self._message = scene_message(change, self._frames)
            self._publisher.publish(self._message)
        if now - self._reported_s > HEALTH_S:
            self._reported_s = now
            words = self._problem or ("drawing" if self._is_subscribed else "waiting for the plant")
            self._health.publish("warn" if self._problem else "ok", words, {"drawn": str(self._count())})

    def _count(self) -> int:
        return len(self._message.markers) if self._message else 0


def main() -> None:
    """Draw until stopped."""
    os.nice(BEHIND)  # nodes that control come first
    sys.exit(run_node(MarkersNode))


if __name__ == "__main__":
    main()
