"""The node that owns a controller: one class for policies and classical laws."""

from __future__ import annotations

import dataclasses
import math
import threading
import time
from collections.abc import Callable

import numpy as np
from geometry_msgs.msg import PointStamped, PoseStamped
from nav_msgs.msg import Odometry
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn

from fulmar_core.controllers.controller import Controller
from fulmar_core.errors import FulmarError
from fulmar_core.robot import Robot, load_robot
from fulmar_core.safety.arbiter import Decision, Flags, Mode, arbitrate
from fulmar_core.safety.command_gate import Rejections, command_problem
from fulmar_core.safety.input_gate import FROZEN_AFTER, InputGate, Measurement
from fulmar_core.safety.watchdog import default_timeout
from fulmar_core.state import Pose, RigidBodyState
from fulmar_core.tasks import Task, load_task
from fulmar_ros.controller_settings import ControllerSettings
from fulmar_ros.controller_wires import ControllerWires
from fulmar_ros.convert import goal_of, measurement_of, stamp_ns
from fulmar_ros.deadline import Deadlines, Spread
from fulmar_ros.parameters import read_parameters
from fulmar_ros.runtime import RequestExit

MakeController = Callable[[Robot, Task, ControllerSettings], Controller]
WARM_UP = 20  # the first inferences are slow; they happen before anything moves
SAFE_REPEATS = 5
AFTER_ODOMETRY_NS = (
    2_000_000  # the beat comes this long after the odometry, which may be a little late itself
)
STATUS_PERIOD_S = 0.4  # at least 2 Hz


class ControllerNode(LifecycleNode):
    """Turns odometry and a goal into commands, by the clock or in lock step with a simulator."""

    def __init__(
        self, make_controller: MakeController, request_exit: RequestExit, *, cli_args: list[str] | None = None
    ) -> None:
        """Read the parameters and, unless told otherwise, start.

        Args:
            make_controller: Loads the controller; called at configuration.
            request_exit: Ends the process.
            cli_args: ROS arguments of this node alone, where it shares a process.

        Raises:
            FulmarError: If a parameter, a configuration file or a policy is wrong.
        """
        super().__init__("controller", cli_args=cli_args)
        self.settings = read_parameters(self, ControllerSettings)
        self.robot = load_robot(self.settings.robot)
        self.task = load_task(self.settings.task)
        self._make_controller, self._request_exit = make_controller, request_exit
        self._lock = threading.Lock()
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None
        hz = self.settings.control_rate(self.robot)
        timeout_s = self.settings.input_timeout_s or default_timeout(1.0 / hz) / min(self.settings.rate, 1.0)
        self._flags = Flags(input_timeout_ns=round(timeout_s * 1e9), geofence=self.robot.limits.geofence)
        noisy = max(self.robot.sensors.odometry.position_std) > 0.0 and not self.settings.lockstep
        self._input_gate = InputGate(self.robot.limits, frozen_after=FROZEN_AFTER if noisy else 0)
        self._rejections = Rejections()
        self._newest: Measurement | None = None
        self._goal: Pose | None = None
        self._goal_stamp_ns = 0
        self._answered_ns, self._answer = -1, self.robot.actuators.safe_command
        self._deadlines = Deadlines(1.0 / (hz * self.settings.rate))
        self._inference_ms = Spread()
        self._steps = 0
        self._said: tuple[object, ...] = ()
        self._said_at = 0.0
        if self.settings.autostart:
            for transition in (self.trigger_configure, self.trigger_activate):
                if transition() != TransitionCallbackReturn.SUCCESS:
                    raise FulmarError(self._refusal)

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Load, validate and warm up the controller; refuse it if anything is wrong."""
        try:
            self.controller = self._make_controller(self.robot, self.task, self.settings)
        except FulmarError as error:
            self._refusal = str(error)
            return TransitionCallbackReturn.FAILURE
        for _ in range(WARM_UP):
            self.controller.act(np.zeros(len(self.controller.observation_names)))
        self.controller.reset()
        self.wires = ControllerWires(
            self,
            self.robot,
            self.task,
            self.controller,
            on_odometry=self._on_odometry,
            on_goal=self._on_goal,
            lockstep=self.settings.lockstep,
        )
        metadata = self.controller.metadata()
        self._sha256 = str(metadata.get("sha256", ""))
        self.wires.publish_metadata(metadata)
        self._set(configured=True)
        return TransitionCallbackReturn.SUCCESS

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Begin to answer."""
        self._set(activated=True)
        if not self.settings.lockstep:
            self._stop.clear()
            self._thread = threading.Thread(target=self._run, name="control", daemon=True)
            self._thread.start()
        else:
            # Lock step has no beat of its own; a wall-clock timer keeps the status alive between messages.
            self._status_timer = self.create_timer(
                STATUS_PERIOD_S / 4, lambda: self._tell_status(self._decide())
            )
        return super().on_activate(state)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Answer no more; the last word is the safe command."""
        self._halt()
        self._set(activated=False)
        return super().on_deactivate(state)

    def stop(self) -> None:
        """Last words before the process ends: the safe command, several times."""
        self._halt()
        if hasattr(self, "wires"):
            for _ in range(SAFE_REPEATS):
                self._publish_safe()
            self.wires.flush()
            self._said_at = 0.0  # the last status has the figures of the whole run
            self._tell_status(self._decide())

    def _halt(self) -> None:
        self._stop.set()
        if self._thread is not None:
            self._thread.join()
            self._thread = None

    def _publish_safe(self) -> None:
        stamp = self._newest.stamp_ns if self._newest else 0
        self.wires.publish_command(self.robot.actuators.safe_command, stamp)

    def _set(self, **changes: object) -> None:
        with self._lock:
            self._flags = dataclasses.replace(self._flags, **changes)  # type: ignore[arg-type]

    def _decide(self) -> Decision:
        with self._lock:
            return arbitrate(self._flags, time.monotonic_ns())

    def _on_goal(self, message: PoseStamped | PointStamped) -> None:
        goal, problem = goal_of(message)
        if goal is None:
            self.get_logger().warning(f"goal refused: {problem}")
            return
        with self._lock:
            self._goal, self._goal_stamp_ns = goal, stamp_ns(message.header.stamp)
            self._flags = dataclasses.replace(self._flags, has_goal=True)
            self.controller.reset()
            if self.settings.lockstep:
                self._input_gate.forget()
        self._tell_status(self._decide())

    def _on_odometry(self, message: Odometry) -> None:
        measurement = measurement_of(message)
        if self.settings.lockstep and measurement.stamp_ns == self._answered_ns:
            self.wires.publish_command(self._answer, self._answered_ns)  # the answer got lost
            return
        with self._lock:
            problem = self._input_gate.problem(measurement) or ""
            changes: dict[str, object] = {"input_problem": problem}
            if not problem:
                if self._newest is None:
                    self._deadlines.align(time.monotonic_ns() + AFTER_ODOMETRY_NS)
                self._newest = measurement
                changes["last_input_ns"] = time.monotonic_ns()
                if self._goal is not None:
                    here, there = measurement.state.position_in_world, self._goal.position_in_world
                    changes["goal_distance"] = math.dist(here[:2], there[:2])
            self._flags = dataclasses.replace(self._flags, **changes)  # type: ignore[arg-type]
        if self.settings.lockstep and self.wires.subscribers() >= self.settings.wait_for_subscribers:
            self._control(measurement.stamp_ns)

    def _run(self) -> None:
        while self._deadlines.wait(self._stop):
            newest = self._newest
            self._control(newest.stamp_ns if newest else 0)

    def _control(self, stamp: int) -> None:
        """One control step: decide, act, publish."""
        decision = self._decide()
        newest, goal = self._newest, self._goal
        if decision.may_act and newest is not None and goal is not None:
            command = self._act(newest.state, goal, stamp)
        else:
            command = self.robot.actuators.safe_command
            if decision.mode is not Mode.IDLE:
                self.wires.publish_command(command, stamp)
        self._answered_ns, self._answer = stamp, command
        self._steps += 1
        self._tell_status(decision)

    def _act(self, state: RigidBodyState, goal: Pose, stamp: int) -> np.ndarray:
        began = time.perf_counter_ns()
        observation = np.asarray(self.task.observe(state, goal))
        action = np.asarray(self.controller.act(observation), dtype=float)
        problem = command_problem(action, len(self.robot.actuators.names))
        command = self.robot.actuators.safe_command if problem else self.robot.actuators.limited(action)
        self.wires.publish_command(command, stamp)
        self._inference_ms.add((time.perf_counter_ns() - began) / 1e6)
        self.wires.publish_reasoning(observation, action, stamp)
        fault = self._rejections.note(problem)
        if fault:
            self._set(latched_fault=fault)
        return command

    def _tell_status(self, decision: Decision) -> None:
        """Publish the status when it changed, and at least twice a second."""
        changed = (
            decision.mode,
            decision.reason.split(" (")[0][:24],
            self._goal_stamp_ns,
            self._rejections.total,
        )
        now = time.monotonic()
        if changed == self._said and now - self._said_at < STATUS_PERIOD_S:
            return
        self._said, self._said_at = changed, now
        level = {Mode.ACTIVE: "ok", Mode.FAULT: "error"}.get(decision.mode, "warn")
        age_ms = (time.monotonic_ns() - self._flags.last_input_ns) / 1e6 if self._flags.last_input_ns else 0.0
        values = {
            "mode": decision.mode.value,
            "reason": decision.reason,
            "sha256": self._sha256,
            "goal_stamp_ns": str(self._goal_stamp_ns),
            "steps": str(self._steps),
            "observation_age_ms": f"{age_ms:.1f}",
            "control_rate_hz": f"{self._deadlines.rate_hz:.4f}",
            "overruns": str(self._deadlines.overruns),
            "rejections": str(self._rejections.total),
            **self._inference_ms.percentiles("inference_ms"),
            **self._deadlines.period_error_ms.percentiles("period_error_ms"),
        }
        self.wires.health.publish(level, decision.reason or decision.mode.value, values)
