"""The node `goals`: publishes goals from a file, one after another, and reports progress."""

from __future__ import annotations

import json
import math
import sys
import threading
import time
from dataclasses import dataclass

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import Odometry
from rclpy.clock import Clock, ClockType
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.publisher import Publisher

from fulmar_bags.gathered import json_object
from fulmar_bags.message_reader import measurement_of, stamp_ns
from fulmar_core.config.errors import DONE, FAILED
from fulmar_core.config.paths import config_names
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import GOAL_PATH, GOAL_WIRES, ODOMETRY, STATUS
from fulmar_core.safety.arbiter import BEYOND_GEOFENCE
from fulmar_core.safety.geofence import OUT_OF_BOUNDS
from fulmar_core.safety.input_gate import Measurement, helper_gate
from fulmar_core.states.state import State
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal import Goal
from fulmar_core.tasks.goal_files import GoalFile, load_goals
from fulmar_core.tasks.goal_sequence import goal_sequence
from fulmar_core.wires.operator_action import GOAL
from fulmar_ros.goal_messages import TYPES, GoalMessage, goal_message
from fulmar_ros.graph import UNNAMED_NODE, running_robots_text
from fulmar_ros.health import Health
from fulmar_ros.operator_actions import OperatorActions
from fulmar_ros.operator_subscription import LateSubscribers, subscribe_every
from fulmar_ros.parameters import name_of, own_frames, read_parameters
from fulmar_ros.qos import EVERYTHING, publish_patiently, publisher_qos
from fulmar_ros.runtime import RequestExit, run_node

PATIENCE_S = 3.0  # for the first odometry and the first subscriber, before a warning
WATCH_S = 0.1
STATUS_PERIOD_S = 0.5  # at least 1 Hz
FLUSH = Duration(seconds=0.5)


@dataclass(frozen=True)
class GoalSettings:
    """ROS parameters of the goal node."""

    goals: str = "lab_pose"  # name of a file in configs/goals, or a path that ends in .yaml
    robot: str = "floating_platform"
    control_hz: float = 10.0  # goals come at most so often in the robot's own time [Hz]
    as_path: bool = False  # publish all positions or poses at once
    input_timeout_s: float = 0.5  # without usable odometry, before a robot shall stand still, at rate 1 [s]
    rate: float = 1.0  # seconds of the robot's own time a wall-clock second
    lockstep: bool = False  # publish the goal with each odometry: plant and controller wait for it
    stay: bool = False  # go on when everything is done, until stopped
    # End with exit code 1 where for so long there is no usable odometry, or no subscriber; 0: wait [s].
    give_up_s: float = 0.0
    # Where to go on: the value `place` of the status of a goal node that has died; empty: at the beginning.
    place: str = ""

    def __post_init__(self) -> None:
        """Refuse values without meaning."""
        for name in ("control_hz", "input_timeout_s", "rate"):
            if not 0.0 < getattr(self, name) < math.inf:
                raise ValueError(f"{name} = {getattr(self, name):g} must be finite and greater than 0.")
        if not 0.0 <= self.give_up_s < math.inf:
            raise ValueError(f"give_up_s = {self.give_up_s:g} must be finite and not negative.")


class GoalNode(Node):
    """Publishes a goal when it differs from the last one, in the time of the odometry that it answers."""

    def __init__(
        self,
        request_exit: RequestExit,
        *,
        goals: GoalFile | None = None,
        cli_args: list[str] | None = None,
    ) -> None:
        """Read the parameters and the goals, and wait for odometry.

        Args:
            request_exit: Ends the process, once everything is done.
            goals: One goal instead of the file that the parameter `goals` names; the node logs that it published it.
            cli_args: ROS arguments of this node alone, where it shares a process.

        Raises:
            FulmarError: If a parameter or a file is wrong.
        """
        super().__init__("goals", cli_args=cli_args)
        self._settings = read_parameters(self, GoalSettings)
        robot = load_robot(self._settings.robot)
        name, self._frames = name_of(self, robot), own_frames(self, robot)
        self._single = goals is not None
        goals = goals or load_goals(self._settings.goals)
        self._title = goals.title
        self._sequence = goal_sequence(goals, robot, as_path=self._settings.as_path)
        self._request_exit = request_exit
        self._gate = helper_gate(robot)
        self._lock = threading.Lock()
        self._sent: Goal | None = None
        self._newest: Measurement | None = None
        self._time_ns, self._sent_at_ns = 0, 0  # of the sequence; it stands still while no odometry comes
        self._go_on(self._settings.place)
        self._period_ns = round(1e9 / self._settings.control_hz)
        self._timeout_s = self._settings.input_timeout_s / min(self._settings.rate, 1.0)
        self._progress = self._sequence.progress
        self._said, self._said_at = "", 0.0
        self._problem, self._stale, self._over = "", False, False
        self._has_odometry, self._alone_checked = False, False
        # The first goal waits for a subscriber; nodes that start together do not look for one.
        self._has_subscriber = self._settings.stay
        self._subscribers_checked = self._settings.stay  # nodes that start together subscribe each other
        self._began = self._usable_at = self._subscribed_at = time.monotonic()
        self._refused = ""  # what the controller said of the newest goal
        wire = GOAL_WIRES[self._sequence.topic]
        # In lock step a goal comes with each odometry, and a recorder that lags behind needs them all. A path is the
        # same in each step and may be long: its newest message is enough.
        streamed = self._settings.lockstep and wire is not GOAL_PATH
        self._publish = publish_patiently if streamed else Publisher.publish
        self._publisher = self.create_publisher(
            TYPES[wire.name], wire.name, publisher_qos(wire, depth=EVERYTHING if streamed else None)
        )
        self._actions = OperatorActions(self)
        self._message: GoalMessage | None = None  # the newest
        if not self._settings.lockstep:  # there a goal comes with each odometry
            LateSubscribers(self, self._publisher, lambda: [self._message] if self._message else [])
        self._health = Health(self, f"{name}: goals")
        subscribe_every(self, Odometry, ODOMETRY, self._on_odometry, depth=10)
        if not self._settings.stay:
            subscribe_every(self, DiagnosticArray, STATUS, self._on_status)
        self.create_timer(WATCH_S, self._watch, clock=Clock(clock_type=ClockType.STEADY_TIME))
        if not self._single:
            self.get_logger().info(f"{goals.title}: goals for {name} on {self._publisher.topic_name}")

    def _go_on(self, place: str) -> None:
        """Take the place of a goal node that has died; a path that it gave whole is with the controller."""
        before = json_object(place)
        if not before:
            return
        numbers = {key: value for key, value in before.items() if isinstance(value, int)}
        self._time_ns = max(0, numbers.get("time_ns", 0))
        self._sequence.go_on_at(numbers)
        if self._sequence.topic == GOAL_PATH.name:
            self._sent = self._sequence.standstill

    def _on_odometry(self, message: Odometry) -> None:
        measurement = measurement_of(message, self._frames)
        with self._lock:
            problem = self._gate.problem(measurement)
            if self._over or problem:
                self._problem = problem or ""
                if self._settings.lockstep and self._sent is not None and not self._over:
                    self._publish_goal(self._sent, measurement.stamp_ns)  # others wait for this stamp
                return
            self._has_odometry = True
            if not (self._has_subscriber or self._subscribed(self._publisher.topic_name)):
                self._usable_at, self._problem, self._stale = time.monotonic(), "", False
                return
            self._has_subscriber = True
            was_done = self._sequence.done
            self._resume(measurement)
            goal = self._sequence.step(self._sequence.form.from_rigid(measurement.state), self._time_ns / 1e9)
            self._publish_progress()
            if self._is_due(goal):
                self._publish_goal(goal, measurement.stamp_ns)
            if self._sequence.done and not was_done:
                self._over = not self._settings.stay
                self.get_logger().info(self._farewell())
                if self._over:
                    self._request_exit(DONE)

    def _resume(self, measurement: Measurement) -> None:
        """Go on with the sequence's time; gaps do not count."""
        if self._newest is not None:
            ahead_ns = measurement.stamp_ns - self._newest.stamp_ns
            if not self._stale and ahead_ns > 0:
                self._time_ns += ahead_ns
        if self._stale:
            self.get_logger().info("odometry is back: going on")
        self._newest, self._usable_at = measurement, time.monotonic()
        self._problem, self._stale = "", False

    def _is_due(self, goal: Goal) -> bool:
        if self._sent is None or self._settings.lockstep:
            return True
        if np.array_equal(goal.targets, self._sent.targets):
            return False
        return self._sequence.done or self._time_ns - self._sent_at_ns >= self._period_ns

    def _publish_goal(self, goal: Goal, stamp_ns: int) -> None:
        self._message = goal_message(
            goal, self._sequence.topic, stamp_ns, self._frames, form=self._sequence.form
        )
        if not self._settings.lockstep:  # there a goal comes with each odometry
            self._actions.say(GOAL, stamp_ns)
        self._publish(self._publisher, self._message)
        if self._single and self._sent is None:
            self.get_logger().info(f"published {self._title} on {self._publisher.topic_name}")
        self._sent, self._sent_at_ns = goal, self._time_ns

    def _on_status(self, message: DiagnosticArray) -> None:
        """Say why the controller refuses the goal, and end where it does for good: it lies too far away."""
        values = {pair.key: pair.value for status in message.status[:1] for pair in status.values}
        reason = values.get("goal_refused", "")
        with self._lock:
            sent = self._message
            mine = sent is not None and values.get("goal_refused_stamp_ns") == str(
                stamp_ns(sent.header.stamp)
            )
            if self._over or not mine or reason == self._refused:
                return
            self._refused = reason
            self._over = reason.startswith(OUT_OF_BOUNDS) or BEYOND_GEOFENCE in reason
        if self._over:
            self.get_logger().error(f"the controller refuses the goal: {reason}")
            self._request_exit(FAILED)
        elif reason:
            self.get_logger().warning(f"the controller refuses the goal: {reason}")

    def _publish_progress(self) -> None:
        if self._sequence.progress != self._progress:
            self._progress = self._sequence.progress
            self.get_logger().info(self._progress)
        if self._sequence.progress != self._said or time.monotonic() - self._said_at > STATUS_PERIOD_S:
            self._said, self._said_at = self._progress, time.monotonic()
            mode = "finished" if self._sequence.done else "running"
            place = json.dumps({**self._sequence.place, "time_ns": self._time_ns})
            values = {"mode": mode, "progress": self._progress, "place": place}
            self._health.publish("ok", self._progress, values)

    def _farewell(self) -> str:
        if self._sequence.topic == "goal_path":
            return "done: one round is over; the controller goes round until another goal comes"
        if self._sequence.topic == "goal_velocity":
            return "done: a standstill goal was published"
        return "done: the robot stays until another goal comes"

    def _watch(self) -> None:
        """Notice silence, of the odometry and of whoever should listen; by a steady clock."""
        if self._settings.give_up_s:
            self._give_up_if_alone()
            self._give_up_if_silent()
        with self._lock:
            now = time.monotonic()
            limit_s = self._timeout_s if self._newest else PATIENCE_S
            late = now - self._usable_at > limit_s and not self._settings.lockstep
            late = late and (self._newest is not None or not self._settings.give_up_s)  # that has its own end
            if late and not self._stale and not self._over:
                self._stale = True
                self._pause()
        if not self._subscribers_checked and now - self._began > PATIENCE_S:
            self._subscribers_checked = True  # once
            if not self._settings.give_up_s and (alone := self._without_subscriber()):
                self.get_logger().warning(f"{alone}. {self._what_is_taken()}".rstrip())

    def _give_up_if_alone(self) -> None:
        """End if the robot or its controller is not there after the time for it."""
        with self._lock:
            if self._over or self._alone_checked or time.monotonic() - self._began < self._settings.give_up_s:
                return
            self._alone_checked = True
            missing, after = self._without_subscriber(), f"(after {self._settings.give_up_s:g} s)"
            advice = self._what_is_taken()
            if not self._has_odometry:
                topic = self.resolve_topic_name(ODOMETRY.name)
                missing = f"no usable odometry: {self._problem or f'nothing comes on {topic}'}"
                advice = ""
            if not missing:
                return
            self._over = True
        if not advice:
            advice = "Start the robot and its controller, or wait for them: fulmar goals --wait. "
            advice += running_robots_text(self)
        self.get_logger().error(f"{missing} {after}. {advice}")
        self._request_exit(FAILED)

    def _give_up_if_silent(self) -> None:
        """End where a robot, or its controller, that was there has been gone for the time for it."""
        with self._lock:
            now, limit_s, topic = time.monotonic(), self._settings.give_up_s, self._publisher.topic_name
            if self._subscribed(topic):
                self._subscribed_at = now
            silent = now - self._usable_at > limit_s
            if self._over or not self._alone_checked or not (silent or now - self._subscribed_at > limit_s):
                return
            self._over = True
            nothing = self._problem or f"nothing comes on {self.resolve_topic_name(ODOMETRY.name)}"
            missing = (
                f"the robot went silent: {nothing}"
                if silent
                else f"no controller subscribes {topic} any more"
            )
        self.get_logger().error(
            f"{missing} (for {limit_s:g} s); {self._progress}. Start it again and give the goals anew, or wait for it: "
            f"fulmar goals --wait. {running_robots_text(self)}"
        )
        self._request_exit(FAILED)

    def _pause(self) -> None:
        topic = self.resolve_topic_name(ODOMETRY.name)
        reason = self._problem or f"nothing comes on {topic}"
        if self._newest is None:
            self.get_logger().warning(f"waiting for odometry: {reason}")
            return
        stands = self._stand_still()
        then = "published a standstill goal" if stands else "the goal stays as it is"
        self.get_logger().warning(f"no usable odometry for {self._timeout_s:g} s ({reason}): {then}")

    def _stand_still(self) -> bool:
        """End a velocity goal; other goals need no end."""
        if self._sequence.topic != "goal_velocity" or self._sent is None or self._newest is None:
            return False
        self._publish_goal(self._sequence.standstill, self._newest.stamp_ns)
        return True

    def _without_subscriber(self) -> str:
        """Which topic has no subscriber, and which tasks have one; empty where there is one."""
        topic = self._publisher.topic_name
        if self._subscribed(topic):
            return ""
        wanted = self._sequence.topic, self._sequence.form
        tasks = [name for name in config_names("tasks") if _taken_by(name) == wanted]
        return f"no controller subscribes {topic}; one does with one of the tasks {', '.join(tasks)}"

    def _what_is_taken(self) -> str:
        """Which goals a running controller takes instead, and how to give them; empty where none runs."""
        taken = [name for name in GOAL_WIRES if self._subscribed(self.resolve_topic_name(name))]
        if not taken:
            return ""
        gives = " or ".join(_how_to_give(name, self._sequence.form) for name in taken)
        return f"The one that runs takes {' and '.join(taken)}: give {gives}."

    def _subscribed(self, topic: str) -> bool:
        """Whether a node other than a recorder subscribes a topic."""
        passive = {"recorder"}
        if time.monotonic() - self._began < PATIENCE_S:
            passive.add(UNNAMED_NODE)  # which may turn out to be one
        return any(info.node_name not in passive for info in self.get_subscriptions_info_by_topic(topic))

    def stop(self) -> None:
        """Publish standstill after a velocity goal."""
        with self._lock:
            if not self._over:
                self._stand_still()
            self._over = True
        self._publisher.wait_for_all_acked(FLUSH)


def _taken_by(task: str) -> tuple[str, type[State]]:
    """Topic and form of a task's goals."""
    found = load_task(task)
    return found.goal_topic, found.state_type


def _how_to_give(topic: str, form: type[State]) -> str:
    """What to tell `fulmar goals` for a controller that takes a topic."""
    numbers = ",".join(form.NUMBERS)
    return {
        "goal_pose": f"--pose {numbers} or a file of poses",
        "goal_point": f"--position {','.join(form.NUMBERS[: form.AXES])} or a file of positions",
        "goal_path": "a file of positions or poses, and --as-path",
        "goal_velocity": "a file of velocities or of a path",
    }[topic]


def main() -> None:
    """Publish goals until they are done, or until stopped."""
    sys.exit(run_node(GoalNode))


if __name__ == "__main__":
    main()
