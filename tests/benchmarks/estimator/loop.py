"""A robot in MuJoCo that an estimator of motion capture and inertial readings steers: no ROS, no clock.

So an hour takes minutes, and a source can fail at any moment.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fulmar_core.control_loop import ControlLoop
from fulmar_core.controllers.controller import Controller
from fulmar_core.disturbances.scenario import Scenario
from fulmar_core.episode import draw_episode
from fulmar_core.estimation.estimator import Estimator
from fulmar_core.goal import goal_in_float64
from fulmar_core.robot import Robot
from fulmar_core.sensors.imu import ImuSample
from fulmar_core.sensors.reading import Reading
from fulmar_core.state import RigidBodyState
from fulmar_core.tasks import Task
from sim_nodes.mujoco_backend import MujocoBackend

NEW_GOAL_S = 20.0  # after which a robot that moves gets another goal
BEGIN_NS = 1_000_000_000
Change = Callable[
    [float, Any], Any
]  # time since the fault [s], and a pose (7,) or an `ImuSample`, to what is reported


@dataclass(frozen=True)
class SourceFault:
    """How sources fail from some time on."""

    pose: Change = lambda _t, pose: pose
    imu: Change = lambda _t, sample: sample


NO_FAULT = SourceFault()


@dataclass
class Outcome:
    """What happened after a fault, or without one."""

    times_s: list[float] = field(default_factory=list)  # of the fault, at every control step
    speeds: list[float] = field(default_factory=list)  # true [m/s]
    turn_rates: list[float] = field(default_factory=list)  # true [rad/s]
    errors: list[float] = field(default_factory=list)  # of the estimated place; NaN without an estimate [m]
    works: list[bool] = field(default_factory=list)  # whether a command other than the safe one was applied
    warnings: dict[str, float] = field(default_factory=dict)  # and when each came first [s]
    blind_s: float = 0.0  # without an estimate, once there was one [s]
    epochs: int = 0
    outliers: int = 0

    @property
    def last_work_s(self) -> float:
        """When the actuators did something for the last time, after the fault; -inf: never [s]."""
        return max(
            (t for t, work in zip(self.times_s, self.works, strict=True) if work and t >= 0.0),
            default=-np.inf,
        )


class EstimatedLoop:
    """One robot, its estimator and its controller."""

    def __init__(
        self,
        robot: Robot,
        task: Task,
        scenario: Scenario,
        estimator: Estimator,
        controller: Controller,
        *,
        seed: int,
        pose_hz: float = 0.0,
    ) -> None:
        """Begin an episode; poses come with each tick, or `pose_hz` times a second [Hz]."""
        self._robot, self._task, self._scenario, self._seed = robot, task.fitted(robot), scenario, seed
        self._backend = MujocoBackend.of(robot, self._task, scenario)
        self._estimator, self._loop = estimator, ControlLoop(robot, self._task, controller)
        self._dt = robot.timing.physics_dt
        self._every = max(1, round(1.0 / (pose_hz * self._dt))) if pose_hz else 1
        self._hold = robot.timing.substeps(controller.control_hz)
        self._safe = np.array(robot.actuators.safe_command, dtype=float)
        self._sample = self._backend.reset(self._episode(0), seed=seed)
        self._loop.begin(self._goal(0))

    def run(
        self, seconds: float, *, moves: bool = True, fault: SourceFault = NO_FAULT, fault_s: float = np.inf
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
            self._sample = self._backend.step(
                command, 1, begins=self._hold if (tick - 1) % self._hold == 0 else 0
            )
            self._measure(tick, t, fault, t - fault_s)
            if tick % self._hold:
                continue
            if moves and tick % round(NEW_GOAL_S / self._dt) == 0:
                self._loop.begin(self._goal(round(t / NEW_GOAL_S)))
            estimate = self._estimator.estimate(BEGIN_NS + round(1e9 * t))
            begun = begun or estimate is not None
            command = self._safe
            if estimate is not None and moves:
                state = self._robot.state_type.from_rigid(estimate.value)[None]
                command = self._loop.step(state, BEGIN_NS + round(1e9 * t)).command[0]
            for words in self._estimator.warnings():
                found.warnings.setdefault(words, t - fault_s)
            found.blind_s += self._hold * self._dt * (begun and estimate is None)
            self._note(found, t - fault_s, None if estimate is None else estimate.value, command)
        found.epochs, found.outliers = self._estimator.epoch, self._estimator.outliers
        return found

    def _measure(self, tick: int, t: float, fault: SourceFault, since_s: float) -> None:
        stamp_ns = BEGIN_NS + round(1e9 * t)
        readings = self._sample.readings
        if (imu := readings.get("imu")) is not None:
            value: ImuSample = imu.value
            self._estimator.take(
                "imu", Reading(fault.imu(since_s, value) if since_s >= 0.0 else value, stamp_ns)
            )
        if tick % self._every == 0:
            seen: RigidBodyState = readings["odometry"].value
            pose = np.concatenate((seen.position_in_world, seen.quat_xyzw))
            pose = fault.pose(since_s, pose) if since_s >= 0.0 else pose
            self._estimator.take("mocap", Reading(pose, stamp_ns))

    def _note(
        self, found: Outcome, since_s: float, believed: RigidBodyState | None, command: np.ndarray
    ) -> None:
        true = self._sample.truth
        assert true is not None
        found.times_s.append(since_s)
        found.speeds.append(float(np.linalg.norm(true.velocity_in_world)))
        found.turn_rates.append(float(np.linalg.norm(true.angular_velocity_in_body)))
        found.errors.append(
            np.nan
            if believed is None
            else float(np.linalg.norm(believed.position_in_world - true.position_in_world))
        )
        found.works.append(not np.array_equal(command, self._safe))

    def _episode(self, number: int) -> Any:
        return draw_episode(self._robot, self._task, self._scenario, seed=self._seed, number=number)

    def _goal(self, number: int) -> Any:
        return goal_in_float64(self._episode(number).goal).mapped(lambda part: np.asarray(part)[None])
