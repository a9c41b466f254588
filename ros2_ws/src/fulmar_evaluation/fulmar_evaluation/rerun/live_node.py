"""A recorded run once more through the deployed controller node, in lock step: we are the plant."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, TwistStamped
from nav_msgs.msg import Odometry
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import Bool, String
from visualization_msgs.msg import MarkerArray

from fulmar_bags.contents import Bag
from fulmar_bags.control_steps import ControlSteps
from fulmar_bags.gathered import json_object
from fulmar_bags.message_reader import stamp_ns
from fulmar_bags.wire_reader import ABSENT, Received
from fulmar_bringup.domains import own_domain
from fulmar_bringup.processes import ProcessGroup
from fulmar_bringup.run_plan import RunPlan
from fulmar_bringup.system import Guards
from fulmar_bringup.system_rows import system_rows
from fulmar_core.config.errors import BagError, RunFailed
from fulmar_core.robots.topics import (
    ACTION,
    ACTUATORS_STATE,
    AIR_BEARING,
    GOAL_POSES,
    GOAL_WIRES,
    METADATA,
    OBSERVATION,
    OBSTACLES,
    ODOMETRY,
    STATUS,
    VELOCITY_COMMAND,
    command_wire,
)
from fulmar_evaluation.rerun.rerun import Answers
from fulmar_ros.convert import VectorWriter
from fulmar_ros.goal_messages import TYPES
from fulmar_ros.qos import FLUSH_S, flush, publisher_qos, subscriber_qos
from fulmar_ros.runtime import init_ros, spinning

START_TIMEOUT_S, ANSWER_TIMEOUT_S = 30.0, 10.0
RESEND_S = 0.5
SETTLE_S = 0.3  # a publisher sees a match some milliseconds before the subscriber's side is ready
REASONING_S = 2.0  # for observation and action, which come after the command
DEPTH = 50


def without_repeats(record: ControlSteps) -> ControlSteps:
    """The same record with each measurement once: in lock step a node answers one only once."""
    kept = np.concatenate(([True], np.diff(record.stamp_ns) != 0))
    rows = ("stamp_ns", "log_ns", "observations", "actions", "commands", "acted", "sample")
    return replace(record, **{name: getattr(record, name)[kept] for name in rows})


def rerun_through_node(
    bag: Bag, record: ControlSteps, controller: str, policy: str, odometry: str | None = None
) -> tuple[Answers, str | None]:
    """Feed a recorded run to a controller node of its own, in a ROS domain of its own.

    Unlike `rerun`, the node goes on from its own answers: terms that hold the previous command may differ after the
    first difference.

    Args:
        bag: Where the messages themselves are.
        record: Of that bag, from `without_repeats`.
        controller: Name of the controller.
        policy: Folder of a bundle; empty where there is none.
        odometry: Topic that the record is made of, where it is not the robot's.

    Returns:
        Its answers and the SHA-256 that it reports.

    Raises:
        BagError: The bag lacks odometry that was answered, or its run cannot be led from outside.
        RunFailed: The node refuses to start, ends, or does not answer.
    """
    missing = int(np.sum(record.sample == ABSENT))
    if missing:
        raise BagError(
            f"{bag.path}: lacks the odometry of {missing} steps, which a node must have. Use --through direct."
        )
    if not record.own:
        raise BagError(
            f"{bag.path}: others recorded it, and a node takes odometry in its own frames only. Use --through direct."
        )
    if any(goal.index == ABSENT for goal in record.goals):
        raise BagError("a node receives the recorded goals, and takes no --goal. Use --through direct.")
    if record.presses or record.settings.estop:
        raise BagError(
            f"{bag.path}: its e-stop goes by the clock on the wall, not by steps. Use --through direct."
        )
    if len(bag.of(GOAL_POSES)):
        raise BagError(f"{bag.path}: has goals on {GOAL_POSES.name}. Use --through direct.")
    if record.changes:
        raise BagError(f"{bag.path}: its controller was changed on the way. Use --through direct.")
    settings = record.settings
    plan = RunPlan(
        robot=record.robot.name,
        task=record.task.name,
        controller=controller,
        backend="mock",
        name=bag.name,
        control_hz=record.settings.control_rate(record.robot),
        policy=os.path.abspath(policy) if policy else "",
        lockstep=True,
        goals="streamed" if settings.goals_streamed else "",
        guards=Guards(
            fallback=settings.fallback or None,
            max_run_time_s=settings.max_run_time_s,
            area=settings.area,
            guard=settings.guard,
        ),
    )
    with own_domain() as environment:
        group = ProcessGroup(environment)
        try:
            group.start(system_rows(plan)["controller"])
            return _exchange(_raw_messages(bag, record, odometry), record, plan.namespace, group)
        finally:
            group.stop_all()


@dataclass
class _Received:
    """What the node has said, by stamp [ns]."""

    changed: threading.Condition = field(default_factory=threading.Condition)
    commands: dict[int, np.ndarray] = field(default_factory=dict)
    observations: dict[int, np.ndarray] = field(default_factory=dict)
    actions: dict[int, np.ndarray] = field(default_factory=dict)
    names: tuple[str, ...] = ()
    status: dict[str, str] = field(default_factory=dict)
    metadata: dict[str, Any] = field(default_factory=dict)
    error: Exception | None = None

    def command_to(self, stamp_ns: int) -> Callable[[], bool]:
        """Whether there is a command to the odometry of a time."""
        return lambda: stamp_ns in self.commands

    def reasons_for(self, stamp_ns: int) -> Callable[[], bool]:
        """Whether there are the observation and the action behind that command."""
        return lambda: stamp_ns in self.observations and stamp_ns in self.actions

    def echo_of(self, name: str, stamp_ns: int) -> Callable[[], bool]:
        """Whether the status names a time."""
        return lambda: self.status.get(name) == str(stamp_ns)


def _exchange(
    raw: dict[str, Sequence[bytes]], record: ControlSteps, namespace: str, group: ProcessGroup
) -> tuple[Answers, str | None]:
    init_ros()
    try:
        node = rclpy.create_node("plant", namespace=namespace)
        received = _Received()
        wires = _Wires(node, record, received)

        def fail(error: Exception) -> None:
            received.error = error

        with spinning(node, fail):
            return _feed(raw, record, group, wires, received)
    finally:
        rclpy.try_shutdown()


class _Wires:
    """Our endpoints: those of a plant and of an operator."""

    def __init__(self, node: Node, record: ControlSteps, received: _Received) -> None:
        self._node, self._received = node, received
        goal = GOAL_WIRES[record.task.goal_topic]
        self.odometry = node.create_publisher(Odometry, ODOMETRY.name, publisher_qos(ODOMETRY))
        self.goal = node.create_publisher(TYPES[goal.name], goal.name, publisher_qos(goal))
        self.obstacles = node.create_publisher(MarkerArray, OBSTACLES.name, publisher_qos(OBSTACLES))
        self.things = {
            thing.wire.name: node.create_publisher(PoseStamped, thing.wire.name, publisher_qos(thing.wire))
            for thing in record.task.things
        }
        self.bearing = node.create_publisher(Bool, AIR_BEARING.name, publisher_qos(AIR_BEARING))
        self.applied = node.create_publisher(JointState, ACTUATORS_STATE.name, publisher_qos(ACTUATORS_STATE))
        wire = command_wire(record.robot)
        by_velocity = wire is VELOCITY_COMMAND
        self._subscribe(TwistStamped if by_velocity else JointState, wire, self._on_command)
        self._subscribe(JointState, OBSERVATION, self._on_observation)
        self._subscribe(JointState, ACTION, self._on_action)
        self._subscribe(DiagnosticArray, STATUS, self._on_status)
        self._subscribe(String, METADATA, self._on_metadata)

    def _subscribe(self, kind: type, wire: Any, callback: Callable[[Any], None]) -> None:
        qos = subscriber_qos(wire, reliable=True, depth=DEPTH)

        def locked(message: Any) -> None:
            with self._received.changed:
                callback(message)
                self._received.changed.notify_all()

        self._node.create_subscription(kind, wire.name, locked, qos)

    def _on_command(self, message: Any) -> None:
        if isinstance(message, TwistStamped):
            values = [message.twist.linear.x, message.twist.angular.z]
        else:
            values = list(message.effort)
        self._received.commands.setdefault(stamp_ns(message.header.stamp), np.array(values))

    def _on_observation(self, message: Any) -> None:
        self._received.names = tuple(message.name)
        self._received.observations[stamp_ns(message.header.stamp)] = np.array(message.position)

    def _on_action(self, message: Any) -> None:
        self._received.actions[stamp_ns(message.header.stamp)] = np.array(message.effort)

    def _on_status(self, message: Any) -> None:
        for status in message.status:
            self._received.status = {pair.key: pair.value for pair in status.values}

    def _on_metadata(self, message: Any) -> None:
        self._received.metadata = json_object(message.data) or {}

    @property
    def matched(self) -> bool:
        """Whether the node receives our odometry, and we receive all that it publishes of a step."""
        said = (OBSERVATION.name, ACTION.name)
        return bool(self.odometry.get_subscription_count()) and all(
            self._node.count_publishers(name) for name in said
        )


def _feed(
    raw: dict[str, Sequence[bytes]],
    record: ControlSteps,
    group: ProcessGroup,
    wires: _Wires,
    received: _Received,
) -> tuple[Answers, str | None]:
    def wait(condition: Callable[[], bool], limit_s: float, what: str) -> None:
        until = time.monotonic() + limit_s
        with received.changed:
            while not received.changed.wait_for(condition, 0.05):
                if received.error is not None:
                    raise RunFailed(f"the replay failed: {received.error!r}") from received.error
                end = group.ended()
                if end is not None:
                    raise RunFailed(f"{end.text}; its own words are above")
                if time.monotonic() > until:
                    raise RunFailed(f"the controller node {what} within {limit_s:g} s")

    wait(lambda: wires.matched and bool(received.metadata), START_TIMEOUT_S, "did not get ready")
    time.sleep(SETTLE_S)
    wires.bearing.publish(Bool(data=not record.bearing or bool(record.bearing[0].value)))
    every = {name: getattr(record, name) for name in ("goals", "obstacles", "bearing")}
    every |= {thing.wire.name: record.things[thing.name] for thing in record.task.things}
    messages = {name: record.before(each) for name, each in every.items()}
    applied_at = np.searchsorted(
        record.applied.stamp_ns, record.stamp_ns
    )  # the first state of each step or after it
    count, width = len(record), len(record.robot.actuators.names)
    actions, commands = np.full((count, width), np.nan), np.full((count, width), np.nan)
    shown: list[np.ndarray | None] = [None] * count
    acted = np.zeros(count, dtype=bool)
    for step in range(count):
        stamp = int(record.stamp_ns[step])
        _publish(step, messages, raw, wires, wait, received, streamed=record.settings.goals_streamed)
        data = raw["odometry"][int(record.sample[step])]
        answered = _answered(received, stamp)
        until = time.monotonic() + ANSWER_TIMEOUT_S
        while not answered:
            if time.monotonic() > until:
                raise RunFailed(
                    f"the controller node did not answer step {step} within {ANSWER_TIMEOUT_S:g} s"
                )
            wires.odometry.publish(data)
            with received.changed:
                answered = received.changed.wait_for(received.command_to(stamp), RESEND_S)
            if not answered and group.ended() is not None:
                wait(lambda: False, 0.0, "ended")
        expects = bool(record.acted[step])
        with received.changed:
            both = received.changed.wait_for(received.reasons_for(stamp), REASONING_S if expects else 0.0)
        commands[step] = received.commands[stamp]
        _publish_applied(record, step, applied_at, commands[step], wires)
        if both:
            acted[step] = True
            shown[step], actions[step] = received.observations[stamp], received.actions[stamp]
    terms = len(received.names)
    observations = np.array([np.full(terms, np.nan) if row is None else row for row in shown])
    answers = Answers(
        observations.reshape(count, terms), received.names, actions, commands, acted, tuple([""] * count)
    )
    return answers, received.metadata.get("sha256")


def _publish_applied(
    record: ControlSteps, step: int, applied_at: np.ndarray, answer: np.ndarray, wires: _Wires
) -> None:
    """Publish what the actuators did from a step to the next as recorded; the answer where that is not known."""
    write = VectorWriter(record.robot.actuators.names)
    end = int(applied_at[step + 1]) if step + 1 < len(record) else len(record.applied)
    for index in range(int(applied_at[step]), end):
        wires.applied.publish(write.write(record.applied.values[index], int(record.applied.stamp_ns[index])))
    if not len(record.applied):
        wires.applied.publish(write.write(answer, int(record.stamp_ns[step])))


def _answered(received: _Received, stamp: int) -> bool:
    with received.changed:
        return stamp in received.commands


def _raw_messages(bag: Bag, record: ControlSteps, odometry: str | None) -> dict[str, Sequence[bytes]]:
    return {
        "odometry": bag.odometry(odometry).data,
        "goals": bag.of(GOAL_WIRES[record.task.goal_topic]).data,
        "obstacles": bag.of(OBSTACLES).data,
        "bearing": bag.of(AIR_BEARING).data,
        **{thing.wire.name: bag.of(thing.wire).data for thing in record.task.things},
    }


def _publish(
    step: int,
    messages: dict[str, dict[int, list[Received]]],
    raw: dict[str, Sequence[bytes]],
    wires: _Wires,
    wait: Callable[[Callable[[], bool], float, str], None],
    received: _Received,
    *,
    streamed: bool,
) -> None:
    """Publish what was received before a step, as the very bytes that were recorded, and wait until the node has it."""
    publishers = {"bearing": wires.bearing, "obstacles": wires.obstacles, "goals": wires.goal, **wires.things}
    echoes = {"obstacles": "obstacles_stamp_ns", "goals": "goal_stamp_ns"}
    for name, publisher in publishers.items():
        for each in messages[name].get(step, ()):
            publisher.publish(raw[name][each.index])
            if name == "bearing":
                flush([publisher], FLUSH_S)  # its state has no stamp: it must come before the odometry
            if name in echoes and not (streamed and name == "goals"):
                wait(
                    received.echo_of(echoes[name], each.stamp_ns), START_TIMEOUT_S, f"did not take its {name}"
                )
