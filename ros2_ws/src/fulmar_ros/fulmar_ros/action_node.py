"""The node `actions`: takes goals of Nav2's action clients, and gives them to the controller of one robot.

A robot has one goal at a time: a newer one, of whichever action, takes the place of the one before.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import TransformStamped
from nav_msgs.msg import Odometry
from rclpy.action import ActionServer, CancelResponse
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.publisher import Publisher

from fulmar_bags.message_reader import measurement_of
from fulmar_core.loop.action_end import (
    CONTROLLER_TIMED_OUT,
    ODOMETRY_SILENT_S,
    STATUS_SILENT_S,
    TF_ERROR,
    ActionEnd,
    end_of,
    stamp_of,
)
from fulmar_core.loop.pursuit import Pursuit, checked_task
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import GOAL_WIRES, ODOMETRY, ORIGIN, STATUS
from fulmar_core.safety.arbiter import Mode
from fulmar_core.safety.geofence import NO_AREA, check_area, check_area_of
from fulmar_core.safety.input_gate import Measurement, helper_gate
from fulmar_core.tasks import load_task
from fulmar_core.wires.operator_action import GOAL
from fulmar_ros.action_messages import ACTIONS, Action, ActionGoal, Progress, execute_goal, goal_problem
from fulmar_ros.frame_wires import pose_of
from fulmar_ros.goal_messages import TYPES, GoalMessage, goal_message
from fulmar_ros.health import Health
from fulmar_ros.operator_actions import OperatorActions
from fulmar_ros.operator_subscription import LateSubscribers, subscribe_every
from fulmar_ros.parameters import name_of, own_frames, read_parameters
from fulmar_ros.qos import publisher_qos
from fulmar_ros.runtime import RequestExit, run_node

WATCH_S = 0.1
HEALTH_S = 0.5
FEEDBACK_S = 0.1  # between two messages of feedback, and between two points of a path
PREEMPTED = "a newer goal took its place"
CANCELED = "cancelled by its client: the robot stays where it is"


@dataclass(frozen=True)
class ActionSettings:
    """ROS parameters of the action node."""

    robot: str = "floating_platform"
    task: str = "go_to_pose"
    thing: str = ""  # in space, in the place of that of the task; empty: as the task has it
    area: tuple[float, ...] = NO_AREA  # as in `Guards.area` [m]
    unmapped: bool = False  # the topic `origin` says nothing of `map`: another node localizes a real robot

    def __post_init__(self) -> None:
        """Refuse an area that is none."""
        if self.area != NO_AREA:
            check_area(self.area)


@dataclass
class Active:
    """The goal that the robot follows."""

    action: Action
    handle: Any
    pursuit: Pursuit
    began_s: float
    sent_s: float = 0.0  # when its newest target was published
    sent: np.ndarray | None = None
    stamps: set[int] = field(default_factory=set)  # of its messages [ns]
    taken: bool = False  # whether the controller has followed one of them
    acted_s: float = 0.0  # when the controller acted last
    said_s: float = 0.0  # when feedback was published


class ActionNode(Node):
    """Serves `navigate_to_pose`, `navigate_through_poses` and `follow_path` in the robot's namespace."""

    def __init__(self, _request_exit: RequestExit, *, cli_args: list[str] | None = None) -> None:
        """Read the parameters, and wait for goals.

        Args:
            cli_args: ROS arguments of this node alone, where it shares a process.

        Raises:
            FulmarError: If a parameter or a file is wrong, or the messages of the actions are not installed.
        """
        super().__init__("actions", cli_args=cli_args)
        settings = read_parameters(self, ActionSettings)
        self._robot = robot = load_robot(settings.robot)
        self._task = checked_task(load_task(settings.task, settings.thing))
        self._task.check_running(robot)
        check_area_of(robot, settings.area)
        self._area, self._frames, self._name = settings.area, own_frames(self, robot), name_of(self, robot)
        self._gate = helper_gate(robot)
        self._active: Active | None = None
        self._newest: Measurement | None = None
        self._stamp_ns = 0  # of the newest goal that was published
        self._seen_s = self._reported_s = self._said_s = 0.0
        self._met = self._ended = 0
        self._words = "waiting for a goal"
        wire = GOAL_WIRES[self._task.goal_topic]
        self._publisher: Publisher = self.create_publisher(TYPES[wire.name], wire.name, publisher_qos(wire))
        self._message: GoalMessage | None = None
        LateSubscribers(self, self._publisher, lambda: [self._message] if self._message else [])
        self._operator = OperatorActions(self)
        self._health = Health(self, f"{self._name}: actions")
        self._servers = {action.name: self._serve(action) for action in ACTIONS}
        self._origin: np.ndarray | None = None  # pose of `odom` in `map`, shape (7,)
        if not settings.unmapped:
            subscribe_every(self, TransformStamped, ORIGIN, self._on_origin)
        subscribe_every(self, Odometry, ODOMETRY, self._on_odometry, depth=10)
        subscribe_every(self, DiagnosticArray, STATUS, self._on_status)
        self.create_timer(WATCH_S, self._watch, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def _serve(self, action: Action) -> ActionServer:
        return ActionServer(
            self,
            action.type(),
            action.name,
            execute_callback=lambda _handle: None,  # each goal has its own, once it has ended
            handle_accepted_callback=partial(self._begin, action),
            cancel_callback=lambda _handle: CancelResponse.ACCEPT,
        )

    def _begin(self, action: Action, handle: Any) -> None:
        """Follow a goal, or abort it at once with the reason; the one before goes on then."""
        asked = ActionGoal.of(action, handle.request, self._frames, self._origin)
        end = asked.problem or goal_problem(self._robot, self._task, asked.targets, self._area)
        if end is None and self._newest is None:
            end = ActionEnd(
                TF_ERROR, "no odometry yet: the robot's place is not known. Is the plant running?"
            )
        if not handle.is_cancel_requested:
            execute_goal(handle)
        if end is not None:
            self.get_logger().warning(f"{action.name}: goal refused: {end.words}")
            self._finish(action, handle, handle.abort, end)
            return
        if self._active is not None:
            before, self._active = self._active, None
            self._close(before, before.handle.abort, ActionEnd(0, PREEMPTED))
        pursuit = Pursuit(self._robot, self._task, asked.targets, follows=action.follows)
        self._active = Active(action, handle, pursuit, began_s=time.monotonic())
        self.get_logger().info(f"{action.name}: {len(asked.targets)} poses")
        assert self._newest is not None
        self._pursue(self._active, self._newest)

    def _on_origin(self, message: TransformStamped) -> None:
        self._origin = pose_of(message)

    def _on_odometry(self, message: Odometry) -> None:
        measurement = measurement_of(message, self._frames)
        if self._gate.problem(measurement):
            return
        self._newest, self._seen_s = measurement, time.monotonic()
        if self._active is not None:
            self._pursue(self._active, measurement)

    def _pursue(self, active: Active, measurement: Measurement) -> None:
        """See how far the robot is, and publish the target that counts from now on."""
        now, pursuit = time.monotonic(), active.pursuit
        pursuit.see(measurement.state, measurement.stamp_ns / 1e9)
        if active.handle.is_cancel_requested:
            self._end(active.handle.canceled, ActionEnd(0, CANCELED), stays=True)
            return
        if pursuit.reached:
            self._met += 1
            self._end(active.handle.succeed, ActionEnd(0, ""), stays=False)
            return
        target = pursuit.target
        due = not active.action.follows or now - active.sent_s >= FEEDBACK_S
        if due and (active.sent is None or not np.array_equal(target, active.sent)):
            self._publish_goal(target, measurement.stamp_ns)
            active.sent, active.sent_s = target, now
            active.stamps.add(self._stamp_ns)
        if now - active.said_s >= FEEDBACK_S:
            active.said_s = now
            progress = Progress(measurement, pursuit, now - active.began_s)
            active.handle.publish_feedback(active.action.feedback(progress, self._frames))

    def _publish_goal(self, target: np.ndarray, stamp_ns: int) -> None:
        self._stamp_ns = stamp_ns = max(stamp_ns, self._stamp_ns + 1)  # the same stamp would be a repetition
        goal = self._task.goal_of(target)
        form = self._task.state_type
        self._message = goal_message(goal, self._task.goal_topic, stamp_ns, self._frames, form=form)
        self._operator.say(GOAL, stamp_ns)
        self._publisher.publish(self._message)

    def _on_status(self, message: DiagnosticArray) -> None:
        self._reported_s = time.monotonic()
        active = self._active
        if active is None or not message.status:
            return
        values = {pair.key: pair.value for pair in message.status[0].values}
        active.taken = active.taken or stamp_of(values, "goal_stamp_ns") in active.stamps
        if values.get("mode") == Mode.ACTIVE.value or not active.acted_s:
            active.acted_s = self._reported_s
        end = end_of(
            values,
            active.stamps,
            since_s=self._reported_s - active.began_s,
            taken=active.taken,
            held_s=self._reported_s - active.acted_s,
        )
        if end is not None:
            self._end(active.handle.abort, end, stays=True)

    def _watch(self) -> None:
        """Notice silence by a steady clock, and report."""
        now, active = time.monotonic(), self._active
        if active is not None and active.handle.is_cancel_requested:
            self._end(active.handle.canceled, ActionEnd(0, CANCELED), stays=True)
        elif active is not None and now - self._seen_s > ODOMETRY_SILENT_S:
            self._end(active.handle.abort, ActionEnd(TF_ERROR, "no odometry any more"), stays=True)
        elif active is not None and now - max(self._reported_s, active.began_s) > STATUS_SILENT_S:
            silent = ActionEnd(CONTROLLER_TIMED_OUT, "the controller reports nothing any more")
            self._end(active.handle.abort, silent, stays=True)
        if now - self._said_s >= HEALTH_S:
            self._said_s = now
            values = {"goals_met": str(self._met), "goals_ended": str(self._ended)}
            doing = self._active.action.name if self._active is not None else ""
            self._health.publish("ok", doing or self._words, {"mode": doing or "idle", **values})

    def _end(self, change: Callable[[], None], end: ActionEnd, *, stays: bool) -> None:
        """End the active goal; `stays`: the robot gets its own place for a goal, so that no other is latched."""
        active, self._active = self._active, None
        assert active is not None
        if stays and self._newest is not None:
            state = self._newest.state
            here = np.concatenate((state.position_in_world, state.quat_xyzw))[None]
            self._publish_goal(here, self._newest.stamp_ns)
        self._close(active, change, end)

    def _close(self, active: Active, change: Callable[[], None], end: ActionEnd) -> None:
        self._words = f"{active.action.name}: {end.words or 'met'}"
        self.get_logger().info(self._words)
        self._finish(active.action, active.handle, change, end)

    def _finish(self, action: Action, handle: Any, change: Callable[[], None], end: ActionEnd) -> None:
        """Send a result with an end."""
        self._ended += 1
        change()
        server = self._servers[action.name]
        server.notify_execute(handle, lambda _handle: action.result(end))

    def stop(self) -> None:
        """Abort the goal that is under way: its server ends."""
        if self._active is not None:
            self._end(self._active.handle.abort, ActionEnd(0, "the action server ends"), stays=True)


def main() -> None:
    """Serve actions until stopped."""
    sys.exit(run_node(ActionNode))


if __name__ == "__main__":
    main()
