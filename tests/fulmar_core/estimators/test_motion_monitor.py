"""A controller's own comparison of what was applied with its odometry."""

from __future__ import annotations

import numpy as np

from fulmar_core.estimators.actuator_health.applied import AppliedHistory
from fulmar_core.estimators.actuator_health.motion_monitor import MotionMonitor
from fulmar_core.robots.robot_file import load_robot
from tests.states import planar_state

BASE = load_robot("turtlebot2")
STEP_NS = 100_000_000


def watched(*, dead: bool, known: bool = True, steps: int = 60, gap: range = range(0)) -> MotionMonitor:
    """A monitor of a base whose right wheel may not turn, and whose applied commands may not be known."""
    history, rng = AppliedHistory(2 * STEP_NS), np.random.default_rng(0)
    monitor, half = MotionMonitor(BASE, history), 0.5 * BASE.actuators.track
    for step in range(steps):
        left = right = 0.2
        if dead and step > 20:
            right = 0.0
        speed, rate = 0.5 * (left + right), (right - left) / (2.0 * half)
        noise = 0.01 * rng.standard_normal(2)
        state = planar_state(0.0, 0.0, 0.0, vx=speed + noise[0], yaw_rate=rate + noise[1])
        monitor.take(state, step * STEP_NS)
        if known and step not in gap:
            history.add(step * STEP_NS, np.array([0.2, 0.0]))
    return monitor


def test_a_wheel_that_does_not_turn_is_believed_dead():
    beliefs = watched(dead=True).beliefs
    assert beliefs.dead == ("right_wheel",)
    assert beliefs.words == beliefs.warnings != ()


def test_sound_wheels_are_not_believed_dead():
    assert watched(dead=False).beliefs.dead == ()


def test_nothing_is_believed_where_it_is_not_known_what_was_applied():
    assert watched(dead=True, known=False).beliefs.dead == ()


def test_evidence_from_before_a_gap_counts_no_more():
    assert watched(dead=True, steps=46).beliefs.dead == ("right_wheel",)
    assert watched(dead=True, steps=50, gap=range(34, 37)).beliefs.dead == ()
    assert watched(dead=True, steps=60, gap=range(34, 37)).beliefs.dead == ("right_wheel",)
