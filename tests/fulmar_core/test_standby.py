"""A controller is warm, and has forgotten its warm-up, before it may act."""

from __future__ import annotations

import json

import numpy as np
import pytest

from fulmar_core.paths import config_names
from fulmar_core.robot import load_robot
from fulmar_core.safety.fallback import WARM_UP, warm_up
from fulmar_core.tasks import load_task

ROBOT = load_robot("turtlebot2")


class Counting:
    """Counts what it is asked since its last reset, and keeps what it saw."""

    name, control_hz, estimator = "counting", ROBOT.timing.control_hz, None

    def __init__(self):
        self.seen, self.since_reset = [], 0

    def reset(self):
        self.since_reset = 0

    def act(self, inputs):
        self.since_reset += 1
        self.seen.append(inputs.observation)
        return np.zeros_like(inputs.previous)

    def metadata(self):
        return {"controller": self.name, "sha256": "abc"}


@pytest.mark.parametrize("task", config_names("tasks"))
def test_it_is_asked_for_commands_of_its_task_and_begins_anew(task):
    controller = Counting()
    warm_up(controller, ROBOT, load_task(task))
    assert len(controller.seen) == WARM_UP
    assert np.isfinite(controller.seen).all()
    assert controller.since_reset == 0


def test_its_metadata_is_json_with_what_is_said_beside_its_own():
    standby = warm_up(Counting(), ROBOT, load_task("go_to_pose"), said={"fallback": "lqr"})
    assert json.loads(standby.metadata) == {"controller": "counting", "sha256": "abc", "fallback": "lqr"}
    assert standby.sha256 == "abc"
