"""What a simulated plant publishes, and requests to it that a server waits for."""

from __future__ import annotations

import json
import math
import threading
import time
import uuid
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np
from geometry_msgs.msg import PoseStamped, TransformStamped
from nav_msgs.msg import Odometry
from rclpy.node import Node
from std_msgs.msg import String

from fulmar_bags.gathered import json_object
from fulmar_bags.message_reader import measurement_of, stamp_ns, thing_of
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.topics import (
    ORIGIN,
    SIMULATION_EVENT,
    SIMULATION_RESULT,
    SIMULATION_STATE,
    TRUTH,
    Wire,
)
from fulmar_core.simulation.state_requests import FIELDS, PAUSE, RESUME, STEP
from fulmar_core.states.state import RigidBodyState
from fulmar_core.tasks import Task
from fulmar_core.wires.robot_name import Frames
from fulmar_ros.frame_wires import pose_of
from fulmar_ros.operator_subscription import subscribe_every
from fulmar_ros.qos import publisher_qos, subscriber_qos
from fulmar_ros.simulation_messages import ROBOT, THING, Entity, Outcome, failed, still_at

ANSWER_S = 3.0  # for the plant to answer [s]
REPEAT_S = 0.3  # between two requests of the same id
STEP_S = 10.0  # for a control step, by the wall clock: a controller in lock step may be slow [s]
SEEN_S = 1.0  # for a running plant to publish what a change led to [s]
TICK_SHARE = 0.5  # of a physics tick, by which stamps may differ


class SimulationPlant(Node):
    """A node beside the one that serves: its thread takes messages while the other one waits for them.

    Attributes:
        paused: Whether simulated time stands still.
        origin: Pose of `odom` in `map`, shape (7,); None: not known.
        seen_s: When the newest state came, by the steady clock [s].
    """

    def __init__(self, server: Node, robot: Robot, task: Task, frames: Frames, *, control_hz: float) -> None:
        """Subscribe, with topics renamed as those of `server`, which has the ROS arguments."""
        super().__init__("simulation_plant", namespace=server.get_namespace(), use_global_arguments=False)
        self._frames, self._resolve = frames, server.resolve_topic_name
        self._changed = threading.Condition()
        self._step_ns = round(1e9 / control_hz)
        self._tick_ns = round(1e9 * robot.timing.physics_dt)
        self._newest: Entity | None = None
        self._given: Entity | None = None  # that a paused robot was put into: no newer one has been published
        self._things: dict[str, Entity] = {}
        self._answers: dict[str, dict[str, Any] | None] = {}  # to requests that are waited for, by their id
        self.paused, self.seen_s, self._over = False, -math.inf, False
        self.origin: np.ndarray | None = None
        self._requests = self.create_publisher(
            String, self._resolve(SIMULATION_STATE.name), publisher_qos(SIMULATION_STATE)
        )
        truth = subscriber_qos(TRUTH, reliable=True, depth=50)
        self.create_subscription(Odometry, self._resolve(TRUTH.name), self._on_truth, truth)
        self._every(TransformStamped, ORIGIN, self._on_origin)
        self._every(String, SIMULATION_EVENT, self._on_event)
        self._every(String, SIMULATION_RESULT, self._on_result)
        for thing in task.things:
            self._every(PoseStamped, thing.wire, partial(self._on_thing, thing.name))

    def entities(self, name: str) -> dict[str, Entity]:
        """Bodies of the simulation by name, the robot first, as far as their states have come.

        Args:
            name: Of the robot.
        """
        with self._changed:
            robot = self._given or self._newest
            return {**({name: robot} if robot else {}), **self._things}

    def pause(self, paused: bool) -> Outcome:
        """Let simulated time stand still, or go on."""
        outcome, _ = self._ask({"what": PAUSE if paused else RESUME})
        if outcome.good and not self._wait(lambda: self.paused == paused, SEEN_S):
            return failed("the plant does not report the change.")
        return outcome

    def steps(self, count: int) -> Outcome:
        """Take control steps of a paused simulation, and wait for what they lead to."""
        outcome, answer = self._ask({"what": STEP, "steps": count})
        if not outcome.good:
            return outcome
        before = int(answer["stamp_ns"])
        after_ns = before + count * self._step_ns - round(TICK_SHARE * self._tick_ns)
        while not self._wait(lambda: self._stamp_ns >= after_ns, STEP_S):
            if self._stamp_ns <= before:
                return failed(f"no step was finished for {STEP_S:g} s. Does the controller run?")
            before = self._stamp_ns
        return outcome

    def change(self, request: Mapping[str, Any]) -> Outcome:
        """Put the robot elsewhere, or let it begin anew; returns once its state shows it."""
        outcome, answer = self._ask(request)
        if not outcome.good:
            return outcome
        state = RigidBodyState(*(np.array(answer[key], dtype=float) for key in FIELDS))
        after_ns = int(answer["stamp_ns"])
        with self._changed:
            self._given = Entity(ROBOT, state, after_ns)
            self._newest = self._given
        if not self.paused:
            self._wait(lambda: self._stamp_ns > after_ns + self._tick_ns, SEEN_S)
        return outcome

    def stop(self) -> None:
        """Let no request wait any longer."""
        with self._changed:
            self._over = True
            self._changed.notify_all()

    @property
    def _stamp_ns(self) -> int:
        return self._newest.stamp_ns if self._newest else 0

    def _every(self, kind: type, wire: Wire, callback: Callable[..., None]) -> None:
        subscribe_every(self, kind, wire, callback, topic=self._resolve(wire.name))

    def _wait(self, ready: Callable[[], bool], within_s: float) -> bool:
        """Wait until something is so, in the thread of the server; False: it never was."""
        with self._changed:
            return self._changed.wait_for(lambda: self._over or ready(), within_s) and not self._over

    def _ask(self, request: Mapping[str, Any]) -> tuple[Outcome, dict[str, Any]]:
        """Ask the plant, and ask again until it answers: it does the same request once."""
        name = uuid.uuid4().hex
        text = json.dumps({"id": name, "by": "simulation_interfaces", **request})
        until_s = time.monotonic() + ANSWER_S
        with self._changed:
            self._answers[name] = None
        try:
            while time.monotonic() < until_s and not self._over:
                self._requests.publish(String(data=text))
                if self._wait(lambda: self._answers[name] is not None, REPEAT_S):
                    answer = self._answers[name] or {}
                    done, reason = bool(answer.get("accepted")), str(answer.get("reason", ""))
                    return (Outcome() if done else Outcome("INCORRECT_STATE", reason)), answer
        finally:
            with self._changed:
                self._answers.pop(name, None)
        return failed("the simulated plant does not answer. Does it run?"), {}

    def _on_truth(self, message: Odometry) -> None:
        found = measurement_of(message, self._frames)
        with self._changed:
            self.seen_s = time.monotonic()
            if self._given is None or found.stamp_ns > self._given.stamp_ns:
                self._given, self._newest = None, Entity(ROBOT, found.state, found.stamp_ns)
            self._changed.notify_all()

    def _on_thing(self, name: str, message: PoseStamped) -> None:
        pose, _problem = thing_of(message, self._frames)
        if pose is not None:
            with self._changed:
                self._things[name] = still_at(pose, THING, stamp_ns(message.header.stamp))

    def _on_origin(self, message: TransformStamped) -> None:
        self.origin = pose_of(message)

    def _on_event(self, message: String) -> None:
        what = (json_object(message.data) or {}).get("what")
        if what in (PAUSE, RESUME):
            with self._changed:
                self.paused = what == PAUSE
                self._changed.notify_all()

    def _on_result(self, message: String) -> None:
        answer = json_object(message.data) or {}
        with self._changed:
            if answer.get("id") in self._answers:
                self._answers[answer["id"]] = answer
                self._changed.notify_all()
