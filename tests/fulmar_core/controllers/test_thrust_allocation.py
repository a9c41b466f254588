"""Shares of thrust for a wanted wrench, against a numerical optimiser that knows nothing of a dual."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize

from fulmar_core.controllers.allocation import allocation_of
from fulmar_core.controllers.opening_allocation import OpeningAllocation
from fulmar_core.controllers.thrust_allocation import ThrustAllocation
from fulmar_core.controllers.valve_allocation import ValveAllocation
from fulmar_core.robots.actuators.pushing import PLANAR
from fulmar_core.robots.robot_file import load_robot
from tests.new_robots import new_robot

FANS = new_robot("fan_disc").actuators
WEIGHT = np.array([[2.0, 0.1, 0.0], [0.1, 1.5, 0.2], [0.0, 0.2, 50.0]])
COST = 0.01
ALLOCATION = ThrustAllocation(FANS, weight=WEIGHT, cost=COST)
FULL = FANS.full_thrust[:, None] * FANS.wrench_per_newton[:, PLANAR]
WANTED = np.random.default_rng(0).normal(size=(12, 3)) * (1.0, 1.0, 0.2)


def cost(shares, wanted, price=COST):
    miss = shares @ FULL - wanted
    return miss @ WEIGHT @ miss + price * shares @ shares


def slope(shares, wanted):
    return 2.0 * (FULL @ (WEIGHT @ (shares @ FULL - wanted)) + COST * shares)


@pytest.mark.parametrize("size", [0.05, 0.5, 5.0])
def test_no_shares_are_cheaper(size):
    for wanted in size * WANTED:
        chosen = ALLOCATION.best(wanted)
        assert chosen.min() >= 0.0
        assert chosen.max() <= 1.0
        found = minimize(
            cost,
            np.full(6, 0.3),
            args=(wanted,),
            jac=slope,
            bounds=[(0.0, 1.0)] * 6,
            method="L-BFGS-B",
            options={"ftol": 1e-15, "gtol": 1e-12},
        )
        assert cost(chosen, wanted) <= found.fun + 1e-9


def test_a_reachable_wrench_is_all_but_exact_where_fans_cost_nothing():
    free = ThrustAllocation(FANS, weight=WEIGHT, cost=0.0)
    wanted = np.random.default_rng(4).uniform(0.05, 0.8, (20, 6)) @ FULL
    np.testing.assert_allclose(free.best(wanted) @ FULL, wanted, atol=1e-4)


def test_nothing_wanted_lets_every_fan_rest():
    assert not ALLOCATION.best(np.zeros(3)).any()


def test_a_batch_is_answered_like_its_members():
    together = ALLOCATION.best(WANTED)
    np.testing.assert_allclose(together, [ALLOCATION.best(row) for row in WANTED], rtol=0, atol=1e-9)
    assert ALLOCATION.best(WANTED.reshape(3, 4, 3)).shape == (3, 4, 6)


def test_a_dead_fan_stays_at_rest_and_the_others_make_up_for_it():
    alive = np.ones((12, 6))
    alive[:, 2] = 0.0
    chosen = ALLOCATION.best(WANTED, alive)
    assert not chosen[:, 2].any()
    naive = ALLOCATION.best(WANTED) * alive
    costs = [
        [cost(row, wanted) for row, wanted in zip(rows, WANTED, strict=True)] for rows in (chosen, naive)
    ]
    assert (np.array(costs[0]) <= np.array(costs[1]) + 1e-12).all()
    assert np.sum(costs[0]) < np.sum(costs[1]) - 1e-3


def test_what_is_dearer_is_used_less():
    dear = ALLOCATION.best(WANTED, None, np.full(12, 5.0))
    assert dear.sum() < 0.9 * ALLOCATION.best(WANTED).sum()


def test_each_family_gets_its_allocation_and_what_pushes_both_ways_none():
    platform, flyer = load_robot("floating_platform").actuators, load_robot("modular_freeflyer").actuators
    found = {
        ValveAllocation: platform,
        OpeningAllocation: flyer,
        ThrustAllocation: replace(flyer, shared_pressure=False),
    }
    for kind, actuators in found.items():
        assert isinstance(allocation_of(actuators, weight=WEIGHT, cost=COST), kind)
    with pytest.raises(ValueError, match="push one way; propellers push both"):
        allocation_of(load_robot("kingfisher").actuators, weight=WEIGHT, cost=COST)
