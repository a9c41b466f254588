"""Compares what is applied to the actuators of a robot with what its sensors say they do."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from fulmar_core.estimators.actuator_health.by_kind import JOINTS, MOTION
from fulmar_core.estimators.actuator_health.failed_part import Finding
from fulmar_core.estimators.actuator_health.joint_feedback import ReactionWheelFeedback, SurfaceFeedback
from fulmar_core.estimators.actuator_health.supply_check import SupplyCheck
from fulmar_core.robots.robot import Robot
from fulmar_core.simulation.backend import Sample
from fulmar_core.states.state import RigidBodyState
from fulmar_core.wires.reading import Reading


class JointCheck:
    """Compares joints that are measured one by one, where commands are applied; any thread may read its findings."""

    def __init__(self, robot: Robot) -> None:
        """Begin without findings; robots without such sensors have none."""
        check = JOINTS.get(robot.kind.name)
        self._check = check(robot) if check is not None and check.SENSOR in robot.sensors.specs else None
        self.findings: tuple[Finding, ...] = ()

    def reset(self) -> None:
        """Begin anew: an episode or an activation begins."""
        self.findings = ()
        if self._check is not None:
            self._check.reset()

    def see(self, command: np.ndarray, seconds: float, readings: Mapping[str, Reading]) -> None:
        """Take a command, shape (n,), how long it was applied [s], and the readings at the end."""
        if self._check is None:
            return
        reading = readings.get(self._check.SENSOR)
        self._check.see(command, seconds, None if reading is None else _values(reading.value, self._check))
        self.findings = self._check.findings


def _values(value: Any, check: SurfaceFeedback | ReactionWheelFeedback) -> np.ndarray:
    """What was measured of each joint in the robot's order; NaN for what was not."""
    numbers = getattr(value, check.VALUES)
    if value.names == check.names:
        return np.asarray(numbers)
    by_name = dict(zip(value.names, numbers, strict=False))
    return np.array([by_name.get(name, np.nan) for name in check.names], dtype=float)


class MotionCheck:
    """Compares how a robot moves with what is applied to its actuators; any thread may read its findings."""

    def __init__(self, robot: Robot) -> None:
        """Begin without findings; robots whose motion does not show single actuators have none."""
        check = MOTION.get((robot.kind.name, robot.actuators.kind))
        self._check = None if check is None else check(robot)
        self.findings: tuple[Finding, ...] = ()

    @property
    def watches(self) -> bool:
        """Whether the motion of this robot shows single actuators."""
        return self._check is not None

    def reset(self) -> None:
        """Begin anew: place or time jumped, or what was applied is not known."""
        self.findings = ()
        if self._check is not None:
            self._check.reset()

    def see(self, command: np.ndarray, seconds: float, motion: RigidBodyState | None) -> None:
        """Take a command, shape (n,), how long it was applied [s], and the motion at the end; None: not measured."""
        if self._check is not None:
            self._check.see(command, seconds, motion)
            self.findings = self._check.findings


class ActuatorFeedback:
    """Compares every command of a plant with what its backend measures; any thread may read its findings.

    Attributes:
        findings: Parts that do not do what is applied to them.
        supply: What feeds them.
    """

    def __init__(self, robot: Robot, *, moves: bool) -> None:
        """Begin without findings; `moves`: whether the backend's odometry is the one that is published."""
        self._joints, self._motion = JointCheck(robot), MotionCheck(robot) if moves else None
        self.supply = SupplyCheck(robot)
        self._vital = robot.actuators.names[: robot.actuators.positions]
        self.findings: tuple[Finding, ...] = ()

    @property
    def grounds(self) -> Finding | None:
        """Why no controller may go on: a surface has failed, or the tank is empty; None if neither is so."""
        failed = next((finding for finding in self.findings if finding.part in self._vital), None)
        return failed or self.supply.empty

    def reset(self) -> None:
        """Begin anew, with an episode."""
        self.findings = ()
        self._joints.reset()
        self.supply.reset()
        if self._motion is not None:
            self._motion.reset()

    def see(self, command: np.ndarray, seconds: float, sample: Sample) -> None:
        """Take a command that was applied, shape (n,), for how long [s], and the sample at the end."""
        self._joints.see(command, seconds, sample.readings)
        self.supply.see(seconds, sample.readings, sample.odometry)
        if self._motion is None:
            self.findings = self._joints.findings
            return
        self._motion.see(command, seconds, sample.odometry)
        self.findings = (*self._joints.findings, *self._motion.findings)
