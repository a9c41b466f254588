"""What is asked of a robot that has lost too many valves to hold a pose: the place, whatever the heading.

Where no mean wrench is left in some direction (`fulmar_core.holding`), a platform that turns its working nozzles to
where it has to brake can still come to rest at its goal. A reward that asks for the heading all the way there keeps it
from learning that.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fulmar_core.disturbances.scenario import Scenario
from fulmar_core.holding import stranding_losses
from fulmar_core.robot import Robot
from fulmar_core.tasks import Task
from fulmar_core.tasks.go_to_pose import GoToPose


@dataclass(frozen=True)
class Stranded:
    """Which combinations of valves leave no pose to hold, and what is asked then."""

    task: Task  # the learner's own, with the weights that count
    codes: np.ndarray  # of these combinations, one bit for each valve that works

    @classmethod
    def of(cls, robot: Robot, task: Task, scenario: Scenario) -> Stranded | None:
        """All that a scenario can lead to; None where the task asks for the same whatever may be lost."""
        if not isinstance(task, GoToPose) or task.stranded_weights is None:
            return None
        every = (1 << len(robot.actuators.names)) - 1
        losses = (
            lost
            for count in range(1, scenario.actuation.failures + 1)
            for lost in stranding_losses(robot, count)
        )
        codes = [every - sum(1 << valve for valve in lost) for lost in losses]
        if not codes:
            return None
        return cls(replace(task, reward_weights=task.stranded_weights), np.array(codes, dtype=int))

    def among(self, alive: np.ndarray) -> np.ndarray:
        """Numbers of the worlds that are stranded, where `alive` is 1 for each valve that works, shape (n, worlds)."""
        bits = 1 << np.arange(len(alive))
        return np.flatnonzero(np.isin(bits @ (alive > 0.5), self.codes))
