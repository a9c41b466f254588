"""Warm stand-by, and the switch between primary and fallback controller."""

from __future__ import annotations

import json

import numpy as np
import pytest

from fulmar_core.config.paths import config_names
from fulmar_core.loop.fallback import WARM_UP, ControllerSwitch, warm_up
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.safety.command_gate import REJECTIONS_TO_LATCH
from fulmar_core.tasks import load_task
from tests.spaces import robot_for

ROBOT, IN_SPACE = load_robot("turtlebot2"), load_robot("cubesat_8")


class Counting:
    """Counts what it is asked since its last reset, and keeps what it saw."""

    name, control_hz, estimator = "counting", ROBOT.timing.control_hz, None
    readings, observer = (), None

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
    warm_up(controller, robot_for(load_task(task), ROBOT, IN_SPACE), load_task(task))
    assert len(controller.seen) == WARM_UP
    assert np.isfinite(controller.seen).all()
    assert controller.since_reset == 0


def test_its_metadata_is_json_with_what_is_said_beside_its_own():
    standby = warm_up(Counting(), ROBOT, load_task("go_to_pose"), said={"fallback": "lqr"})
    assert json.loads(standby.metadata) == {"controller": "counting", "sha256": "abc", "fallback": "lqr"}
    assert standby.sha256 == "abc"


def reject(switch, times=REJECTIONS_TO_LATCH):
    return [switch.note("it is not finite") for _ in range(times)][-1]


def test_a_controller_that_was_refused_gives_its_place_to_the_fallback_with_the_reason():
    switch = ControllerSwitch(None, "lqr", refused="wrong hash")
    assert (switch.current, switch.fell_back) == ("lqr", "wrong hash")


def test_without_both_there_is_nothing_to_begin_with():
    with pytest.raises(ValueError, match="neither"):
        ControllerSwitch(None, None)


def test_rejections_in_a_row_bring_the_fallback_and_no_fault():
    switch = ControllerSwitch("policy", "lqr")
    assert reject(switch, REJECTIONS_TO_LATCH - 1) is None
    assert switch.current == "policy"
    assert reject(switch, 1) is None
    assert switch.current == "lqr"
    assert "refused" in switch.fell_back


def test_a_good_command_in_between_begins_the_count_anew():
    switch = ControllerSwitch("policy", "lqr")
    for _ in range(5):
        reject(switch, REJECTIONS_TO_LATCH - 1)
        switch.note(None)
    assert switch.current == "policy"


def test_a_fallback_that_fails_too_is_a_fault():
    switch = ControllerSwitch("policy", "lqr")
    reject(switch)
    assert "refused" in reject(switch)
    assert switch.rejections == 2 * REJECTIONS_TO_LATCH


def test_without_a_fallback_rejections_are_a_fault():
    assert reject(ControllerSwitch("policy"))


def test_a_candidate_takes_over_at_the_next_turn_and_not_before():
    switch = ControllerSwitch("old")
    switch.propose("new")
    assert switch.current == "old"
    assert switch.apply()
    assert switch.current == "new"
    assert not switch.apply()


def test_a_candidate_brings_a_count_of_its_own_and_ends_the_fallback():
    switch = ControllerSwitch("old", "lqr")
    reject(switch)
    switch.propose("new")
    switch.apply()
    assert (switch.current, switch.fell_back) == ("new", "")
    reject(switch)
    assert switch.current == "lqr"
