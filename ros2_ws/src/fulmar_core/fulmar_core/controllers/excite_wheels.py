"""Excitation of a satellite for the identification of its inertia: a profile of torques, whatever the attitude."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from fulmar_core.controllers.controller import Inputs
from fulmar_core.controllers.law import Law
from fulmar_core.robots.actuators.reaction_wheels import ReactionWheels
from fulmar_core.robots.robot import Robot
from fulmar_core.tasks import Task
from fulmar_core.tasks.excitation import Torques
from fulmar_core.tasks.torque_profiles import gain_of, profile_of

PARTS = 20  # of a control period, over which the mean of a profile is taken


class ExciteWheels(Law):
    """Plays a profile from its beginning, from the first step on."""

    TASKS: ClassVar[tuple[str, ...]] = ("point",)
    law = "excite"
    title = "a profile of torques, to identify the inertia by"

    gains: Torques

    def __init__(
        self,
        robot: Robot,
        task: Task,
        gains: Torques | None = None,
        *,
        control_hz: float | None = None,
    ) -> None:
        """Prepare; by default with our own profile, that no wheel saturates under.

        Raises:
            ValueError: The task does not turn a satellite.
        """
        if task.kind not in self.TASKS:
            raise ValueError(
                f"'excite' turns a satellite; tasks for that are of kind {', '.join(self.TASKS)}."
            )
        super().__init__(robot, task, gains or Torques(), control_hz=control_hz)

    def bind(self) -> None:
        """See `Law.bind`."""
        wheels, how = self.robot.actuated_by(ReactionWheels), self.gains
        gain = gain_of(self.robot.name, wheels)
        self.profile = profile_of(how.profile, wheels, gain=gain, seed=how.seed, saturate=how.saturate)
        self._unloading = len(wheels.names) - wheels.count
        self._within = (np.arange(PARTS) + 0.5) / (PARTS * self.control_hz)

    def reset(self) -> None:
        """Begin the profile anew."""
        super().reset()
        self._begun_ns: int | None = None

    def command(self, inputs: Inputs) -> np.ndarray:
        """Mean torques of the profile until the next step, so that steps between leave no momentum behind.

        Shapes are those of `Controller.act`.
        """
        if self._begun_ns is None:
            self._begun_ns = inputs.stamp_ns
        now = (inputs.stamp_ns - self._begun_ns) / 1e9
        torque = self.profile.torque(now + self._within).mean(axis=0)
        command = np.concatenate((torque, np.zeros(self._unloading)))
        return np.tile(command, (len(inputs.previous), 1))
