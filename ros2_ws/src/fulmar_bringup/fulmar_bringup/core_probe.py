"""Whether the core moves a robot as it did when a set was certified: a few short episodes, compared by their ends.

Sources change more often than what they compute. A set measured with other sources still holds where a controller
takes the robot to the same places.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fulmar_core.controllers.controller import Controller
from fulmar_core.loop.rollout import batches
from fulmar_core.robots.robot import Robot
from fulmar_core.tasks import Task
from fulmar_core.worlds.scenario import load_scenario

EPISODES, STEPS, SEED = 8, 40, 7
NEAR = 1e-3  # by which the ends of an episode may differ: another processor rounds otherwise [m, rad]
UNLIKE = 1  # episodes that may differ by more, where a rounding opened a valve a step later
DIGITS = 6  # that are recorded


def ends_of(controller: Controller, robot: Robot, task: Task) -> list[list[float]]:
    """Where the robots are after `STEPS` control steps of the scenario `nominal`.

    Returns:
        Of each episode x, y and yaw [m, m, rad]; in space x, y and z [m].

    Raises:
        ConfigError: The controller cannot drive the robot in the task.
    """
    short = replace(task, episode_s=STEPS / controller.control_hz)  # type: ignore[type-var]
    nominal = load_scenario("nominal")
    run = next(batches(controller, robot, short, nominal, episodes=EPISODES, seed=SEED))
    columns = (run.x, run.y, run.yaw if run.z is None else run.z)
    ends: list[list[float]] = np.round(
        np.stack([column[:, -1] for column in columns], axis=1).astype(float), DIGITS
    ).tolist()
    return ends


def alike(known: object, found: list[list[float]]) -> bool:
    """Whether two records of the same episodes end at the same places; False where the first is none."""
    try:
        its = np.array(known, dtype=float)
    except (TypeError, ValueError):
        return False
    mine = np.array(found)
    if its.shape != mine.shape:
        return False
    return int((np.abs(its - mine).max(axis=1) > NEAR).sum()) <= UNLIKE
