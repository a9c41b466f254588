"""Thrust curves backwards, and who gets how much of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.controllers.propeller_allocation import PropellerAllocation
from fulmar_core.robots.actuators.propellers import Propeller
from fulmar_core.robots.robot_file import load_robot

PROPELLERS = load_robot("kingfisher").actuators
LEAST = 0.2
ALLOCATION = PropellerAllocation(PROPELLERS, least=LEAST)
IDLE = np.zeros(2)
ARM = PROPELLERS.propellers[0].position[1]


def effect(push, moment, previous=IDLE):
    """Push and moment that the commands for a wanted push and moment have."""
    command = ALLOCATION.best(np.asarray(push), np.asarray(moment), np.asarray(previous))
    ahead, _, turn = PROPELLERS.planar_wrench(command, np.ones(2))
    return float(ahead), float(turn)


@pytest.mark.parametrize(
    ("push", "moment"), [(10.0, 0.0), (10.0, 1.5), (-4.0, 0.5), (0.0, 2.5), (0.0, -2.5), (30.0, 2.0)]
)
def test_what_the_propellers_can_do_is_done_exactly(push, moment):
    assert effect(push, moment) == pytest.approx((push, moment), abs=1e-9)


def test_more_than_everything_is_everything():
    assert effect(1000.0, 0.0) == pytest.approx((39.0, 0.0))
    assert effect(-1000.0, 0.0) == pytest.approx((-8.0, 0.0))


def test_at_full_speed_the_turn_comes_before_the_push():
    push, moment = effect(1000.0, 3.0)
    assert moment == pytest.approx(3.0)
    assert push == pytest.approx(39.0 - 3.0 / ARM)


def test_a_turn_on_the_spot_does_not_drive_the_boat_off():
    push, moment = effect(0.0, 100.0)
    assert push == pytest.approx(0.0, abs=1e-9)
    assert moment == pytest.approx(8.0 * ARM)  # 4 N astern on one side, as much ahead on the other


def test_next_to_no_thrust_waits_at_the_end_of_the_dead_band_that_is_nearest():
    none = np.asarray(0.0)
    np.testing.assert_allclose(ALLOCATION.best(none, none, np.array([0.7, -0.9])), [0.2, -0.4])
    np.testing.assert_allclose(ALLOCATION.best(none, none, np.array([0.0, 0.1])), [0.0, 0.1])


def test_a_flat_end_of_the_curve_is_reached_with_the_least_command():
    np.testing.assert_allclose(ALLOCATION.best(np.asarray(-8.0), np.asarray(0.0), IDLE), [-0.7, -0.7])
    np.testing.assert_allclose(ALLOCATION.best(np.asarray(39.0), np.asarray(0.0), IDLE), [0.8, 0.8])


def test_a_batch_is_answered_like_its_members():
    rng = np.random.default_rng(2)
    push, moment = 20.0 * rng.normal(size=30), 4.0 * rng.normal(size=30)
    previous = rng.uniform(-1.0, 1.0, (30, 2))
    alone = [ALLOCATION.best(*row) for row in zip(push, moment, previous, strict=True)]
    np.testing.assert_allclose(ALLOCATION.best(push, moment, previous), alone, atol=1e-12)


def test_boats_that_cannot_be_steered_are_refused():
    row = (Propeller("front", (0.5, 0.0, 0.0)), Propeller("back", (-0.5, 0.0, 0.0)))
    with pytest.raises(ValueError, match="side by side"):
        PropellerAllocation(replace(PROPELLERS, propellers=row), least=LEAST)
    with pytest.raises(ValueError, match="below and above 0"):
        PropellerAllocation(replace(PROPELLERS, curve=(0.0, 0.0, 5.0)), least=LEAST)
