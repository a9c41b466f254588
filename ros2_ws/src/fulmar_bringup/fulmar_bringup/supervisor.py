"""The operator's side of a run: publishes goal and obstacles, starts the plant when all are ready, and watches.

The only module of the bringup that uses ROS during a run. The result of the run is read from its bag.
"""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Callable, Iterator, Sequence, Set
from dataclasses import dataclass, field
from functools import cached_property, partial

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rclpy.node import Node
from rclpy.publisher import Publisher
from visualization_msgs.msg import MarkerArray

from fulmar_bringup.node_table import status_names
from fulmar_bringup.run_plan import RunPlan
from fulmar_core.config.errors import RunFailed
from fulmar_core.robots.topics import DIAGNOSTICS, GOAL_WIRES, OBSTACLES, STATUS
from fulmar_core.robots.wire_check import Offer
from fulmar_core.safety.estop import HOLDS, SILENT
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal import Goal, goal_at
from fulmar_core.wires.operator_action import GOAL
from fulmar_ros.goal_messages import TYPES, GoalMessage, goal_message, obstacles_message
from fulmar_ros.graph import offers_of
from fulmar_ros.living_plant import refuse_living_plant, refuse_twins, sees_living_plant
from fulmar_ros.operator_actions import OperatorActions
from fulmar_ros.operator_subscription import SUBSCRIPTIONS, LateSubscribers, subscribe_every
from fulmar_ros.qos import publisher_qos
from fulmar_ros.runtime import ros_node

START_TIMEOUT_S = 30.0
REPEAT_S = 0.5  # after an e-stop was silent, before the goal is published again
SUBSCRIBES_S = 1.0  # for an external controller that publishes already to subscribe its goal
STOP_S = 1.0  # for a plant to come to rest when a run is stopped
PAUSE_S = 1.0  # between two looks of ours; after a longer one we were stopped ourselves
REFUSAL_WORDS_S = 1.0  # for the reason of a refusal, which comes another way than the refusal itself


@dataclass
class Report:
    """The newest status of one node."""

    level: str = "ok"
    message: str = ""
    values: dict[str, str] = field(default_factory=dict)
    received_s: float = 0.0  # when, by a monotonic clock; 0: nothing yet [s]

    def forget(self) -> None:
        """As before the first status."""
        self.level, self.message, self.values, self.received_s = "ok", "", {}, 0.0


class Supervisor:
    """Operator of one robot."""

    def __init__(self, node: Node, plan: RunPlan, errors: list[Exception] | None = None) -> None:
        """Listen to plant and controller of the plan's robot; `errors` gets what a callback raises."""
        task = load_task(plan.task, plan.thing)
        self._node, self._plan, self._task = node, plan, task
        self._made_s = time.monotonic()
        self.plant, self.controller, self.recorder = Report(), Report(), Report()
        self._reports = {"plant": self.plant, "controller": self.controller, "recorder": self.recorder}
        self._looked_s = self._listens_s = time.monotonic()
        self._changed = threading.Condition()
        self._errors: list[Exception] = [] if errors is None else errors
        self.fail = self._errors.append  # gives up the wait of whoever waits
        self._sent: list[GoalMessage] = []  # of the current goal
        self._actions = OperatorActions(node)
        if not plan.standing:
            _ = self._goal  # nodes that start now find it at once
        self._obstacles = (
            node.create_publisher(MarkerArray, OBSTACLES.name, publisher_qos(OBSTACLES))
            if task.sees_obstacles
            else None
        )
        self._sent_obstacles: list[MarkerArray] = []
        if self._obstacles is not None:
            LateSubscribers(node, self._obstacles, lambda: list(self._sent_obstacles))
        for wire in (DIAGNOSTICS, STATUS):
            subscribe_every(node, DiagnosticArray, wire, self._on_diagnostics)
        self._plant_service = node.create_client(ChangeState, "plant/change_state")

    @cached_property
    def _goal(self) -> Publisher:
        """Where goals are published; made where one is given, since a latched one makes plain publishers warn."""
        wire = GOAL_WIRES[self._task.goal_topic]
        made = self._node.create_publisher(TYPES[wire.name], wire.name, publisher_qos(wire))
        LateSubscribers(self._node, made, lambda: list(self._sent))
        return made

    def sees_living_plant(self) -> bool:
        """Whether a plant of this robot runs already, within `DISCOVERY_S`; call before ours is configured."""
        return sees_living_plant(self._node, self._plan.namespace, since_s=self._made_s)

    def refuse_living_plant(self) -> None:
        """Raise ConfigError, with name, process and host, where a plant of this robot runs already."""
        refuse_living_plant(self._node, self._plan.namespace, since_s=self._made_s, spins=True)

    def refuse_twins(self) -> None:
        """Raise TwinRunError where another run of this name begins at the same time; call while ours gets ready."""
        refuse_twins(self._node, self._plan.namespace, status_names())

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        own = f"{self._plan.robot_name}: "
        for status in message.status:
            name = status.name.removeprefix(own)
            if not (status.name.startswith(own) or name in self._reports):
                continue
            with self._changed:
                part = self._reports.setdefault(name, Report())
                part.level = {DiagnosticStatus.OK: "ok", DiagnosticStatus.WARN: "warn"}.get(
                    status.level, "error"
                )
                part.message = status.message
                part.values = {pair.key: pair.value for pair in status.values}
                part.received_s = time.monotonic()
                self._changed.notify_all()

    def report_of(self, node: str) -> Report:
        """The newest status of a node of this robot, by its name; an empty one before its first."""
        return self._reports.get(node, Report())

    def silent_s(self, report: Report) -> float:
        """How long a node has been silent since its last status [s]; 0 before its first.

        Time in which this process did not listen, since it was stopped itself, does not count.
        """
        return self.since_s(report.received_s) if report.received_s else 0.0

    def since_s(self, moment_s: float) -> float:
        """How much of the time since a moment of the monotonic clock this process has listened [s]."""
        return time.monotonic() - max(moment_s, self._listens_s)

    def listen(self) -> None:
        """Count silences from now on, since nobody has looked at them for a while."""
        self._looked_s = self._listens_s = time.monotonic()

    def _notice_own_pause(self) -> None:
        """Begin to count silences anew where this process did not look for a while."""
        now = time.monotonic()
        if now - self._looked_s > PAUSE_S:
            self._listens_s = now
        self._looked_s = now

    def give_goal(self, goal: Goal, *, time_ns: int, alive: Callable[[], None], listeners: int = 1) -> None:
        """Publish a goal, with the obstacles if the task has any, and wait until the controller has them.

        A recorder may find this operator later than the controller does, and a short run would be over by then.

        Velocities in sequence are all sent now, each stamped with its begin, so that tracking depends on the plant's
        clock alone.

        An e-stop that was silent for a moment, as on a busy computer, makes the controller refuse or forget the goal.
        It was not pressed, and nothing has moved yet: the goal is published again, stamped a nanosecond later, since a
        repetition with the same stamp does not count.

        Args:
            goal: The goal, without a batch axis.
            time_ns: Its stamp, by which the controller names it; for velocities also when the first begins [ns].
            alive: Called while waiting; raises to give up.
            listeners: How many nodes have to have found this operator, the controller among them.

        Raises:
            RunFailed: The e-stop was pressed before it fell silent, or since.
        """
        self.give_obstacles(goal, time_ns=time_ns, alive=alive)
        parts = self._timed(goal, time_ns)
        wires = [wire for wire in (self._goal, self._obstacles) if wire is not None]
        stamps = {stamp for _, stamp in parts}

        def found() -> bool:
            return all(wire.get_subscription_count() >= SUBSCRIPTIONS * listeners for wire in wires)

        while not (self._publish_parts(parts, stamps, alive) and self._before_silence(found, stamps, alive)):
            parts = [(part, stamp + 1) for part, stamp in parts]
            stamps = {stamp for _, stamp in parts}
            self.wait_until(lambda: not self._reason.startswith(SILENT), alive)
            self._raise_if_pressed()
            time.sleep(REPEAT_S)
            self._raise_if_pressed()

    @property
    def _reason(self) -> str:
        """Why the controller does not act."""
        return self.controller.values.get("reason", "")

    def _raise_if_pressed(self) -> None:
        """Give up where silence turns out to hide a press: after a reset nothing moves by itself."""
        if self._reason.startswith(HOLDS) and not self._reason.startswith(SILENT):
            raise RunFailed(f"the controller refused the goal: {self._reason}")

    def _publish_parts(
        self, parts: Sequence[tuple[Goal, int]], stamps_ns: Set[int], alive: Callable[[], None]
    ) -> bool:
        """Publish goals, each once the controller has the one before; False if a silent e-stop came between."""
        self._sent = []
        for part, stamp in parts:
            self.controller.values.pop("goal_refused", None)  # of earlier goals
            self._sent.append(
                goal_message(
                    part, self._task.goal_topic, stamp, self._plan.frames, form=self._task.state_type
                )
            )
            self._actions.say(GOAL, stamp)
            self._goal.publish(self._sent[-1])
            if not self._before_silence(partial(self._has, stamp), stamps_ns, alive):
                return False
        return True

    def _has(self, stamp_ns: int) -> bool:
        """Whether the controller reports the goal of a stamp."""
        return self.controller.values.get("goal_stamp_ns") == str(stamp_ns)

    def _before_silence(
        self, condition: Callable[[], bool], stamps_ns: Set[int], alive: Callable[[], None]
    ) -> bool:
        """Wait for something; False if a silent e-stop cost the controller one of these goals first."""
        refused = {str(stamp) for stamp in stamps_ns}

        def lost() -> bool:
            values = self.controller.values
            silent = values.get("goal_refused", "").startswith(SILENT)
            return silent and values.get("goal_refused_stamp_ns") in refused

        self.wait_until(lambda: lost() or condition(), alive)
        return not lost()

    def give_obstacles(self, goal: Goal, *, time_ns: int, alive: Callable[[], None]) -> None:
        """The obstacles alone, if the task has any; arguments as in `give_goal`."""
        if self._obstacles is None:
            return
        self.publish_obstacles(goal, time_ns)
        self.wait_until(lambda: self.controller.values.get("obstacles_stamp_ns") == str(time_ns), alive)

    def publish_obstacles(self, goal: Goal, time_ns: int) -> None:
        """Publish the obstacles, if the task has any, for controllers that are there and those to come."""
        if self._obstacles is not None:
            self._sent_obstacles = [obstacles_message(goal.obstacles, time_ns, self._plan.frames)]
            self._obstacles.publish(self._sent_obstacles[0])

    def publish_goal(self, goal: Goal, *, time_ns: int, alive: Callable[[], None]) -> None:
        """Publish a goal, and obstacles if the task has any, to a controller that reports nothing; as `give_goal`.

        The recorder has found this operator by then, and a controller that subscribes later receives both, too.
        """
        self.wait_until(lambda: self._goal.get_subscription_count() >= SUBSCRIPTIONS, alive)
        until_s = time.monotonic() + SUBSCRIBES_S  # one that takes its goal from elsewhere never subscribes
        self.wait_until(
            lambda: self._goal.get_subscription_count() > SUBSCRIPTIONS or time.monotonic() > until_s, alive
        )
        self.publish_obstacles(goal, time_ns)
        parts = self._timed(goal, time_ns)
        self._sent = [
            goal_message(part, self._task.goal_topic, stamp, self._plan.frames, form=self._task.state_type)
            for part, stamp in parts
        ]
        for _, stamp in parts:
            self._actions.say(GOAL, stamp)
        for message in self._sent:
            self._goal.publish(message)

    def offers(self, topic: str) -> list[Offer]:
        """Publishers of a topic, by its full name, as the graph shows them now."""
        return offers_of(self._node, topic)

    def _timed(self, goal: Goal, time_ns: int) -> list[tuple[Goal, int]]:
        """Goals to publish, with their stamps [ns]."""
        if self._task.step_s is None:
            return [(goal, time_ns)]
        step_ns = round(1e9 * self._task.step_s)
        return [(goal_at(tuple(target)), time_ns + i * step_ns) for i, target in enumerate(goal.targets)]

    def start_plant(self, alive: Callable[[], None], last_words: Callable[[], str] = lambda: "") -> None:
        """Configure and activate the plant.

        Args:
            alive: Called while waiting; raises to give up.
            last_words: The last line that the plant has printed.

        Raises:
            RunFailed: The plant refuses; with its reason.
        """
        alive()
        while not self._plant_service.wait_for_service(0.1):
            alive()
        steps = {"configured": Transition.TRANSITION_CONFIGURE, "activated": Transition.TRANSITION_ACTIVATE}
        for what, transition in steps.items():
            future = self._plant_service.call_async(ChangeState.Request(transition=Transition(id=transition)))
            while not future.done():
                alive()
                time.sleep(0.005)
            if not future.result().success:
                alive()  # a run that begins at the same time may have been faster
                raise RunFailed(f"plant: could not be {what}: {self._reason_of_plant(last_words)}")

    def stop_plant(self, within_s: float = STOP_S) -> None:
        """Deactivate the plant, if it answers in time: its actuators are safe then, and it misses no command."""
        if not self._plant_service.service_is_ready():
            return
        asked = ChangeState.Request(transition=Transition(id=Transition.TRANSITION_DEACTIVATE))
        future, until_s = self._plant_service.call_async(asked), time.monotonic() + within_s
        while not future.done() and time.monotonic() < until_s:
            time.sleep(0.005)

    def _reason_of_plant(self, last_words: Callable[[], str]) -> str:
        until = time.monotonic() + REFUSAL_WORDS_S
        while time.monotonic() < until and not (self.plant.level == "error" or last_words()):
            time.sleep(0.02)
        return (self.plant.message if self.plant.level == "error" else last_words()) or "it gave no reason"

    def wait_until(self, condition: Callable[[], bool], alive: Callable[[], None]) -> None:
        """Wait for a condition, checked with each report; `alive` runs ten times a second and raises to give up."""
        self._notice_own_pause()
        with self._changed:
            while not self._changed.wait_for(condition, 0.1):
                self._notice_own_pause()
                if self._errors:
                    raise RunFailed(f"the supervisor failed: {self._errors[0]!r}") from self._errors[0]
                alive()


@contextlib.contextmanager
def supervisor(plan: RunPlan) -> Iterator[Supervisor]:
    """A supervisor of a plan's robot that listens in a thread of its own until the context ends."""
    errors: list[Exception] = []
    with ros_node("supervisor", errors.append, namespace=plan.namespace) as node:
        yield Supervisor(node, plan, errors)
