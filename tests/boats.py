"""What tests of plans have in common: a boat, a course, quick settings, and controllers that do one thing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fulmar_core.config import load_config
from fulmar_core.robot import load_robot
from fulmar_core.tasks import load_task
from policy_server.planning.loading import settings_path
from policy_server.planning.settings import PlannerSettings

ROBOT, TASK = load_robot("kingfisher"), load_task("go_through_positions")
DT, LIMIT, REACH = 0.1, 0.2, 0.15
SHIPPED = load_config(PlannerSettings, settings_path("kingfisher"))
SMALL = replace(SHIPPED, legs=6, nodes=6, width=3, tries=6, ahead=2, solved=1)
PLACES = np.array([[3.0, 1.0], [4.0, 4.0], [1.0, 5.0], [-1.0, 2.0]])
AT_REST = np.zeros(8)


class Idle:
    """A controller that stays where it is."""

    name, observation_names, control_hz = "idle", (), 1.0 / DT

    def reset(self):
        pass

    def act(self, observation):
        return np.zeros((len(observation), 2))

    def metadata(self):
        return {}


class Held(Idle):
    """A controller that gives commands that were written down."""

    name = "held"

    def __init__(self, commands):
        self._commands, self._step = commands, 0

    def reset(self):
        self._step = 0

    def act(self, observation):
        self._step += 1
        return np.repeat(self._commands[self._step - 1][None], len(observation), axis=0)
