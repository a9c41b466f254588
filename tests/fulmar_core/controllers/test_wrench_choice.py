"""Valves for the wrench that a network asks for."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from fulmar_core.controllers.wrench_choice import (
    FULL_SHARE,
    HASTE_COST,
    TORQUE_WEIGHT,
    VALVE_COST,
    WrenchChoice,
)
from fulmar_core.robots.robot_file import load_robot

ROBOT = load_robot("floating_platform")
CHOICE = WrenchChoice.of(ROBOT)
RNG = np.random.default_rng(3)
SHARES = RNG.uniform(-1.0, 1.0, (100, 3)).astype(np.float32)
DEAD = (RNG.random((100, 8)) < 0.2).astype(np.float32)


def wrench(valves):
    """In units of the strongest force and of the strongest torque over the root of its weight, shape (rows, 3)."""
    force, torque = ROBOT.actuators.wrench_in_body(np.asarray(valves, dtype=float))
    return np.column_stack((force[:, :2], torque[:, 2] * np.sqrt(TORQUE_WEIGHT) / 0.31))


def test_a_full_push_ahead_opens_what_pushes_ahead_alone():
    valves = CHOICE.best(np.array([[1.0, 0.0, 0.0]], dtype=np.float32))
    found = wrench(valves)[0]
    assert found[0] > 0.7
    np.testing.assert_allclose(found[1:], 0.0, atol=1e-9)


def test_what_is_smaller_than_any_combination_opens_nothing():
    assert not CHOICE.best(np.array([[0.01, -0.01, 0.01]], dtype=np.float32)).any()


def test_no_other_combination_comes_nearer_to_what_is_asked_for_its_valve_cost():
    chosen = CHOICE.best(SHARES)

    wanted = FULL_SHARE * SHARES

    def cost(valves):
        dearer = 1.0 + HASTE_COST * np.sum(wanted**2, axis=-1)
        return np.sum((wrench(valves) - wanted) ** 2, axis=-1) + VALVE_COST * dearer * valves.sum(axis=-1)

    others = np.stack([cost(np.tile(row, (len(SHARES), 1))) for row in CHOICE.commands])
    np.testing.assert_allclose(
        cost(chosen), others.min(axis=0), atol=3e-3
    )  # the order in the table counts a little


def test_cheaper_valves_come_nearer_to_the_wrench():
    small = 0.2 * SHARES
    misses = [
        float(
            np.mean(
                np.sum(
                    (wrench(WrenchChoice.of(ROBOT, valve_cost).best(small)) - FULL_SHARE * small) ** 2,
                    axis=-1,
                )
            )
        )
        for valve_cost in (0.2, 1.0)
    ]
    assert misses[0] < 0.9 * misses[1]


def test_dead_valves_are_never_opened():
    assert (CHOICE.best(SHARES) * DEAD).any()
    assert not (CHOICE.best(SHARES, DEAD) * DEAD).any()


@pytest.mark.parametrize("dead", [None, DEAD], ids=["all alive", "some dead"])
def test_margins_have_the_signs_of_the_choice(dead):
    np.testing.assert_array_equal(CHOICE.margins(SHARES, dead) > 0.0, CHOICE.best(SHARES, dead) > 0.5)


def test_tensors_choose_the_same():
    chosen = CHOICE.best(torch.from_numpy(SHARES), torch.from_numpy(DEAD))
    np.testing.assert_array_equal(chosen.numpy(), CHOICE.best(SHARES, DEAD))


@pytest.mark.parametrize("robot", ["turtlebot2", "modular_freeflyer"])
def test_a_robot_without_on_off_valves_is_refused(robot):
    with pytest.raises(ValueError, match="no on/off valves"):
        WrenchChoice.of(load_robot(robot))
