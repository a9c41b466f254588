"""Valves and fans for wrenches of six numbers, and what delta-sigma modulation adds."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from fulmar_core.controllers.allocation import allocation_of
from fulmar_core.controllers.delta_sigma import DeltaSigma
from fulmar_core.controllers.thrust_allocation import ThrustAllocation
from fulmar_core.robots.actuators.fans import Fan, Fans
from fulmar_core.robots.robot_file import load_robot

VALVES = load_robot("spacecraft_16").actuators
WEIGHT = np.diag([3.0, 3.0, 3.0, 31.0, 31.0, 31.0])
ALLOCATION = allocation_of(VALVES, weight=WEIGHT, cost=1e-6)
MOST = np.repeat((0.6, 0.15), 3)
SMALL = np.array([0.02, -0.01, 0.03, 0.004, 0.002, -0.003])  # far below one valve
# Int-Ball2's fans (`jaxa/int-ball2_simulator`, `ib2_gazebo/sim/sim.yaml`).
SIGNS = [(1, 1, 1), (1, -1, 1), (1, -1, -1), (1, 1, -1), (-1, 1, -1), (-1, 1, 1), (-1, -1, 1), (-1, -1, -1)]
PLACE, FORCE = np.array([0.045, 0.07, 0.0555]), -np.array([0.754180198, 0.414799109, 0.509071634])
FANS = Fans(
    "fans", 0.06, tuple(Fan(f"fan_{i}", tuple(s * PLACE), tuple(s * FORCE)) for i, s in enumerate(SIGNS))
)
FULL = FANS.full_thrust[:, None] * FANS.wrench_per_newton


def wrench_of(commands):
    return np.concatenate(VALVES.wrench_in_body(np.asarray(commands)), axis=-1)


def few_open():
    sets = [chosen for size in range(5) for chosen in itertools.combinations(range(16), size)]
    return np.array([np.isin(np.arange(16), chosen).astype(float) for chosen in sets])


def test_four_open_valves_of_sixteen_give_1293_distinct_wrenches():
    assert len(np.unique(np.round(wrench_of(few_open()), 9), axis=0)) == 1293


@pytest.mark.parametrize("dead", [(), (0,), (3, 9)])
def test_no_four_valves_come_nearer_and_dead_ones_stay_closed(dead):
    alive = (~np.isin(np.arange(16), dead)).astype(float)
    commands = few_open()
    commands = commands[commands @ (1.0 - alive) == 0.0]
    wanted = np.random.default_rng(1).normal(size=(40, 6)) * (0.5, 0.5, 0.5, 0.1, 0.1, 0.1)
    chosen = ALLOCATION.best(wanted, np.tile(alive, (40, 1)))
    assert not chosen[:, list(dead)].any()

    def miss(given):
        return np.einsum("...i,ij,...j", given - wanted[:, None], WEIGHT, given - wanted[:, None])

    best = miss(np.tile(wrench_of(commands), (40, 1, 1))).min(axis=1)
    np.testing.assert_allclose(miss(wrench_of(chosen)[:, None])[:, 0], best, atol=2e-5)


def test_a_small_wrench_opens_no_valve_without_modulation_and_comes_out_on_average_with_it():
    assert not ALLOCATION.best(SMALL).any()
    modulation = DeltaSigma(ALLOCATION, VALVES, most=MOST)
    given = np.array([wrench_of(modulation.best(SMALL[None]))[0] for _ in range(400)])
    np.testing.assert_allclose(given.mean(axis=0), SMALL, atol=0.6 / 400 + 1e-9)


def test_each_robot_of_a_batch_owes_its_own_until_reset():
    rng = np.random.default_rng(2)
    asked = rng.normal(size=(20, 3, 6)) * (0.3, 0.3, 0.3, 0.06, 0.06, 0.06)
    together, alone = (DeltaSigma(ALLOCATION, VALVES, most=MOST) for _ in range(2))
    many = np.array([together.best(wanted) for wanted in asked])
    one = np.array([alone.best(wanted[1:2])[0] for wanted in asked])
    np.testing.assert_array_equal(many[:, 1], one)
    without = np.array([ALLOCATION.best(wanted)[1] for wanted in asked])
    assert (one != without).any()
    alone.reset()
    np.testing.assert_array_equal([alone.best(wanted[1:2])[0] for wanted in asked], one)


def test_it_owes_no_more_than_the_limit_however_much_is_asked():
    modulation = DeltaSigma(ALLOCATION, VALVES, most=MOST)
    for _ in range(50):
        modulation.best(np.array([[5.0, 0.0, -5.0, 1.0, 0.0, 0.0]]))
    assert (np.abs(modulation.owed) <= MOST).all()


@pytest.mark.parametrize("size", [0.3, 3.0])
def test_fans_are_the_bounded_least_squares_of_scipy(size):
    weight = np.diag(np.repeat((100.0, 1e5), 3))
    allocation, root = ThrustAllocation(FANS, weight=weight, cost=1e-4), np.sqrt(np.diag(weight))
    rng = np.random.default_rng(3)
    for wanted in size * rng.normal(size=(30, 6)) * (0.1, 0.06, 0.07, 0.002, 0.003, 0.005):
        shares = allocation.best(wanted)
        rows = np.vstack((root[:, None] * FULL.T, np.sqrt(1e-4) * np.eye(8)))
        exact = lsq_linear(rows, np.append(root * wanted, np.zeros(8)), (0.0, 1.0), tol=1e-14)
        np.testing.assert_allclose(shares, exact.x, atol=2e-4)


def test_openings_by_degrees_on_one_line_are_refused_in_space():
    with pytest.raises(ValueError, match="for robots on a floor or on water; in space use on/off valves"):
        allocation_of(replace(VALVES, continuous=True), weight=WEIGHT, cost=0.0)


def test_a_weight_of_another_size_is_refused():
    with pytest.raises(
        ValueError, match="3 numbers for robots on a floor or on water and 6 in space, found 4"
    ):
        allocation_of(VALVES, weight=np.eye(4), cost=0.0)
