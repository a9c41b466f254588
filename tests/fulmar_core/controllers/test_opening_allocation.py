"""The best openings, against a numerical optimiser that knows nothing of corners."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize

from fulmar_core.controllers.opening_allocation import OpeningAllocation
from fulmar_core.robots.robot_file import load_robot

THRUSTERS = load_robot("modular_freeflyer").actuators
WEIGHT = np.array([[2.0, 0.1, 0.0], [0.1, 1.5, 0.2], [0.0, 0.2, 5.0]])
VALVE_COST = 0.03
ALLOCATION = OpeningAllocation(THRUSTERS, weight=WEIGHT, valve_cost=VALVE_COST)
WANTED = np.random.default_rng(0).normal(size=(15, 3))


ALONE = THRUSTERS.thrust * THRUSTERS.wrench_per_newton[:, (0, 1, 5)]  # of each valve, fully open


def cost(openings, wanted):
    miss = openings @ ALONE - wanted
    return miss @ WEIGHT @ miss + VALVE_COST * np.sum(openings)


@pytest.mark.parametrize("size", [0.1, 0.5, 2.0])
def test_no_openings_are_cheaper(size):
    for wanted in size * WANTED:
        chosen = ALLOCATION.best(wanted)
        assert chosen.min() >= 0.0
        assert chosen.sum() <= 1.0 + 1e-9
        found = minimize(
            cost,
            np.full(8, 0.05),
            args=(wanted,),
            bounds=[(0.0, 1.0)] * 8,
            constraints={"type": "ineq", "fun": lambda openings: 1.0 - np.sum(openings)},
            method="SLSQP",
            options={"ftol": 1e-12, "maxiter": 500},
        )
        assert cost(chosen, wanted) == pytest.approx(found.fun, abs=1e-6)


def test_the_wrench_is_that_of_the_thrusters_own_model():
    openings = ALLOCATION.best(WANTED)
    ahead, left, moment = THRUSTERS.planar_wrench(openings.T, np.ones((8, len(WANTED))))
    np.testing.assert_allclose(np.stack((ahead, left, moment), axis=-1), openings @ ALONE, atol=1e-12)


def test_a_reachable_wrench_is_exact_where_valves_cost_nothing():
    free = OpeningAllocation(THRUSTERS, weight=WEIGHT, valve_cost=0.0)
    wanted = np.random.default_rng(4).dirichlet(np.ones(9), size=20)[:, 1:] @ ALONE
    np.testing.assert_allclose(free.best(wanted) @ ALONE, wanted, atol=1e-9)


def test_nothing_wanted_opens_nothing():
    assert not ALLOCATION.best(np.zeros(3)).any()


def test_a_batch_is_answered_like_its_members():
    together = ALLOCATION.best(WANTED)
    assert together.shape == (15, 8)
    np.testing.assert_allclose(together, [ALLOCATION.best(row) for row in WANTED], atol=1e-12)


def test_banks_without_a_shared_line_are_refused():
    with pytest.raises(ValueError, match="need 'shared_pressure'"):
        OpeningAllocation(replace(THRUSTERS, shared_pressure=False), weight=WEIGHT, valve_cost=0.0)
