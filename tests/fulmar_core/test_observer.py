"""The estimate that a controller uses of its actuators, and what feeds it between two observations."""

from __future__ import annotations

import numpy as np
import pytest

from fulmar_core.controllers.classical import load_classical
from fulmar_core.health.observer import AppliedFeed, health_of
from fulmar_core.robot import load_robot
from fulmar_core.tasks import load_task

PLATFORM, POSE = load_robot("floating_platform"), load_task("go_to_pose")
MS = 1_000_000
OPEN = np.eye(8)[2]


@pytest.fixture
def feed():
    """States of the actuators every 20 ms from 1 s to 1.2 s."""
    found = AppliedFeed(pause_ns=150 * MS, hold_ns=50 * MS)
    for stamp in range(1000, 1200, 20):
        found.history.add(stamp * MS, OPEN)
    return found


def test_an_observer_receives_what_was_applied_since_its_last_observation(feed):
    feed.since_observation(1020 * MS)
    applied = feed.since_observation(1120 * MS)
    assert applied.duration_s == pytest.approx(0.1)
    np.testing.assert_array_equal(applied.commands, [OPEN])


def test_nothing_is_known_of_the_first_interval_of_a_pause_or_of_what_was_forgotten(feed):
    assert feed.since_observation(1010 * MS) is None
    assert feed.since_observation(1180 * MS) is None, "170 ms are a pause"
    feed.forget()
    assert feed.since_observation(1190 * MS) is None


@pytest.mark.parametrize(
    ("stamp", "answered", "lacks"),
    [(1300, 1200, True), (1300, 1180, False), (1400, 1200, False), (1200, 1200, False)],
    ids=["on its way", "here", "a pause", "the same again"],
)
def test_a_state_is_waited_for_that_belongs_to_the_last_answer(feed, stamp, answered, lacks):
    assert feed.lacks(stamp * MS, answered * MS) is lacks


def test_the_health_of_a_controller_is_the_estimate_that_its_last_command_used():
    lqr = load_classical(PLATFORM, POSE, law="lqr")
    lqr.reset()
    assert health_of(lqr) is None
    lqr.act(np.zeros(len(lqr.observation_names)))
    assert health_of(lqr) is lqr.watch.health
    assert health_of(lqr).effectiveness.shape == (8,)


@pytest.mark.parametrize(("robot", "law"), [("floating_platform", "lqr_drift"), ("turtlebot2", None)])
def test_a_controller_without_an_estimator_has_no_health(robot, law):
    controller = load_classical(load_robot(robot), POSE, law=law)
    controller.reset()
    controller.act(np.zeros(len(controller.observation_names)))
    assert health_of(controller) is None
