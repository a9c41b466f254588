"""A robot is given up for a dead actuator only where no pose can be held without it."""

from __future__ import annotations

import threading

import pytest

from fulmar_core.estimators.actuator_health.losses import Losses, can_hold_without
from fulmar_core.robots.robot_file import load_robot

S = 1_000_000_000


@pytest.mark.parametrize(
    ("robot", "lost", "holds"),
    [
        ("floating_platform", (2,), True),
        ("floating_platform", (0, 1, 2, 3), False),
        ("spacecraft_16", (2,), True),
        ("int_ball2", (), True),
        ("int_ball2", (2,), False),
    ],
)
def test_a_pose_can_be_held_where_the_others_push_and_turn_every_way(robot, lost, holds):
    assert can_hold_without(load_robot(robot), lost) == holds


def known(losses, dead, stamp_ns):
    """What is said once the answer is there."""
    losses.hopeless(dead, stamp_ns)
    for thread in threading.enumerate():
        if thread.name == "losses":
            thread.join(10.0)
    return losses.hopeless(dead, stamp_ns)


def test_a_robot_is_given_up_once_its_actuator_is_believed_dead_for_long_enough():
    losses = Losses(load_robot("int_ball2"))
    assert not known(losses, ("fan_3",), 0)
    assert not losses.hopeless(("fan_3",), 1 * S)
    assert losses.hopeless(("fan_3",), 2 * S)
    assert not losses.hopeless((), 3 * S)
    assert not losses.hopeless(("fan_3",), 4 * S)


def test_a_robot_that_can_do_without_it_goes_on():
    losses = Losses(load_robot("spacecraft_16"))
    known(losses, ("thruster_3",), 0)
    assert not known(losses, ("thruster_3",), 60 * S)


def test_in_lock_step_the_answer_is_there_at_once():
    losses = Losses(load_robot("int_ball2"), waits=True)
    assert not losses.hopeless(("fan_3",), 0)
    assert losses.hopeless(("fan_3",), 2 * S)
