"""A robot in MuJoCo that is steered by what is made of its sensors: no ROS, no clock.

So an hour takes minutes, and a source can fail at any moment.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from fulmar_core.controllers.controller import Controller
from fulmar_core.estimators.motion.estimator import Estimator
from fulmar_core.loop.control_loop import ControlLoop
from fulmar_core.robots.robot import Robot
from fulmar_core.safety.input_gate import InputGate, Measurement
from fulmar_core.simulation.backend import Sample
from fulmar_core.simulation.episode import draw_episode
from fulmar_core.states.state import RigidBodyState
from fulmar_core.tasks import Task
from fulmar_core.tasks.goal import goal_in_float64
from fulmar_core.wires.reading import Reading
from fulmar_core.worlds.scenario import Scenario
from sim_nodes.mujoco_backend import MujocoBackend

NEW_GOAL_S = 20.0  # after which a robot that moves gets another goal
BEGIN_NS = 1_000_000_000
# Time since a fault [s], and a pose (7,), an `ImuSample` or an odometry's `RigidBodyState`, to what is reported.
Change = Callable[[float, Any], Any]


def unchanged(_since_s: float, value: Any) -> Any:
    """What a sound source reports."""
    return value


@dataclass(frozen=True)
class SourceFault:
    """How sources fail from some time on."""

    pose: Change = unchanged
    imu: Change = unchanged
    odometry: Change = unchanged


NO_FAULT = SourceFault()


class Follower(Protocol):
    """What makes a state of sensors."""

    def take(self, tick: int, stamp_ns: int, sample: Sample, fault: SourceFault, since_s: float) -> None:
        """Take what the sensors report at a tick; `since_s`: time since the fault, negative before it [s]."""

    def state(self, stamp_ns: int) -> RigidBodyState | None:
        """The state at a time; None: it is not known."""

    def warnings(self) -> tuple[str, ...]:
        """What endangers the robot."""


class EstimatedState:
    """By an estimator of motion capture and inertial readings."""

    def __init__(self, estimator: Estimator, *, every: int = 1) -> None:
        """Take a pose with every so many ticks."""
        self.estimator, self._every = estimator, every

    def take(self, tick: int, stamp_ns: int, sample: Sample, fault: SourceFault, since_s: float) -> None:
        """See `Follower.take`; motion capture sees what the odometry measures."""
        imu, pose = (fault.imu, fault.pose) if since_s >= 0.0 else (unchanged, unchanged)
        if "imu" in sample.readings:
            self.estimator.take("imu", Reading(imu(since_s, sample.readings["imu"].value), stamp_ns))
        if tick % self._every == 0:
            seen: RigidBodyState = sample.readings["odometry"].value
            value = pose(since_s, np.concatenate((seen.position_in_world, seen.quat_xyzw)))
            self.estimator.take("mocap", Reading(value, stamp_ns))

    def state(self, stamp_ns: int) -> RigidBodyState | None:
        """See `Follower.state`."""
        estimate = self.estimator.estimate(stamp_ns)
        return None if estimate is None else estimate.value

    def warnings(self) -> tuple[str, ...]:
        """See `Follower.warnings`."""
        return self.estimator.warnings()


class GatedOdometry:
    """By the odometry, as far as a controller's gate lets it in."""

    def __init__(self, gate: InputGate) -> None:
        self._gate = gate
        self._state: RigidBodyState | None = None

    def take(self, _tick: int, stamp_ns: int, sample: Sample, fault: SourceFault, since_s: float) -> None:
        """See `Follower.take`."""
        state = sample.readings["odometry"].value
        state = fault.odometry(since_s, state) if since_s >= 0.0 else state
        problem = self._gate.problem(Measurement(stamp_ns, "odom", "base_link", state))
        self._state = None if problem else state

    def state(self, _stamp_ns: int) -> RigidBodyState | None:
        """See `Follower.state`."""
        return self._state

    def warnings(self) -> tuple[str, ...]:
        """See `Follower.warnings`."""
        return (self._gate.warning,) if self._gate.warning else ()


@dataclass
class Outcome:
    """What happened; times are since the fault, or since the beginning."""

    warnings: dict[str, float] = field(default_factory=dict)  # and when each came first [s]
    last_command_s: float = (
        -np.inf
    )  # when a command was applied that is not the safe one, for the last time [s]
    blind_s: float = 0.0  # without a state, once there was one [s]
    speed: float = 0.0  # at the fault [m/s]
    most_speed: float = 0.0  # true, after the fault [m/s]
    error: float = 0.0  # of the place that was believed, at most [m]


class SteeredRobot:
    """One robot, what makes a state of its sensors, and its controller."""

    def __init__(
        self,
        robot: Robot,
        task: Task,
        scenario: Scenario,
        follower: Follower,
        controller: Controller,
        *,
        seed: int,
    ) -> None:
        """Begin an episode."""
        self._robot, self._task, self._scenario, self._seed = robot, task.fitted(robot), scenario, seed
        self._backend = MujocoBackend.of(robot, self._task, scenario)
        self._follower, self._loop = follower, ControlLoop(robot, self._task, controller)
        self._dt = robot.timing.physics_dt
        self._hold = robot.timing.substeps(controller.control_hz)
        self._safe = np.array(robot.actuators.safe_command, dtype=float)
        self._sample = self._backend.reset(self._episode(0), seed=seed)
        self._loop.begin(self._goal(0))

    def run(
        self, seconds: float, *, moves: bool = True, fault: SourceFault = NO_FAULT, fault_s: float = 0.0
    ) -> Outcome:
        """Let time pass.

        Args:
            seconds: How much [s].
            moves: Whether it is steered; else every command is the safe one.
            fault: How sources fail.
            fault_s: When [s].
        """
        found, command, begun = Outcome(), self._safe, False
        for tick in range(1, round(seconds / self._dt) + 1):
            t = tick * self._dt
            begins = self._hold if (tick - 1) % self._hold == 0 else 0
            self._sample = self._backend.step(command, 1, begins=begins)
            stamp_ns = BEGIN_NS + round(1e9 * t)
            self._follower.take(tick, stamp_ns, self._sample, fault, t - fault_s)
            for words in self._follower.warnings():
                found.warnings.setdefault(words, t - fault_s)
            if tick % self._hold:
                continue
            if moves and tick % round(NEW_GOAL_S / self._dt) == 0 and self._task.goal_topic == "goal_pose":
                self._loop.begin(self._goal(round(t / NEW_GOAL_S)))
            state = self._follower.state(stamp_ns)
            begun = begun or state is not None
            found.blind_s += self._hold * self._dt * (begun and state is None)
            command = self._safe
            if state is not None and moves:
                command = self._loop.step(
                    self._robot.state_type.from_rigid(state)[None], {}, stamp_ns
                ).command[0]
            self._note(found, t - fault_s, state, command)
        return found

    def _note(
        self, found: Outcome, since_s: float, state: RigidBodyState | None, command: np.ndarray
    ) -> None:
        true = self._sample.truth
        assert true is not None
        speed = float(np.linalg.norm(true.velocity_in_world))
        if since_s < 0.0:
            found.speed = speed
            return
        found.most_speed = max(found.most_speed, speed)
        if state is not None:
            error = float(np.linalg.norm(state.position_in_world - true.position_in_world))
            found.error = max(found.error, error)
        if not np.array_equal(command, self._safe):
            found.last_command_s = since_s

    def _episode(self, number: int) -> Any:
        return draw_episode(self._robot, self._task, self._scenario, seed=self._seed, number=number)

    def _goal(self, number: int) -> Any:
        return goal_in_float64(self._episode(number).goal).mapped(lambda part: np.asarray(part)[None])
