"""A controller that is ready to act at the next step: loaded, checked and warm."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

import numpy as np

from fulmar_core.control_loop import ControlLoop
from fulmar_core.controllers.controller import Controller
from fulmar_core.disturbances.scenario import load_scenario
from fulmar_core.episode import draw_episodes
from fulmar_core.errors import ConfigError, TaskError
from fulmar_core.goal import goal_in_float64
from fulmar_core.own_class import SEPARATOR, one_line
from fulmar_core.robot import Robot
from fulmar_core.tasks import Task

WARM_UP = 20  # the first inferences are slow; they happen before anything moves


@dataclass(frozen=True)
class Standby:
    """One controller with its identity."""

    controller: Controller
    metadata: str  # JSON, ready to publish
    sha256: str


def ready(controller: Controller, robot: Robot, task: Task, *, said: dict[str, Any] | None = None) -> Standby:
    """Warm a controller up, on the start of an episode of its task.

    Args:
        controller: Loaded and checked.
        robot: The robot.
        task: What it does.
        said: More entries of its metadata.

    Raises:
        ConfigError: It raised.
    """
    episode = draw_episodes(robot, task, load_scenario("nominal"), seed=0, numbers=np.zeros(1, dtype=int))
    loop = ControlLoop(robot, task, controller)
    loop.begin(goal_in_float64(episode.goal))
    try:
        for number in range(WARM_UP):
            loop.step(episode.start, round(1e9 * number * loop.dt))
        controller.reset()
    except TaskError:
        raise
    except Exception as error:
        module = controller.name.partition(SEPARATOR)[0]
        raise ConfigError(f"controller '{controller.name}' raised {one_line(error, module)}.") from error
    metadata = {**controller.metadata(), **(said or {})}
    text = json.dumps(metadata, sort_keys=True)
    return Standby(controller, text, str(metadata.get("sha256", "")))
