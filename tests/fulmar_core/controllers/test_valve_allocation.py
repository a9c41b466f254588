"""The best valves, against trying all 256 combinations."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fulmar_core.controllers import valve_allocation
from fulmar_core.controllers.valve_allocation import ValveAllocation
from fulmar_core.robots.actuators.thrusters import Nozzle
from fulmar_core.robots.robot_file import load_robot

THRUSTERS = load_robot("floating_platform").actuators
ALL = np.array(list(itertools.product((0.0, 1.0), repeat=8)))
WEIGHT = np.array([[2.0, 0.1, 0.0], [0.1, 1.5, 0.2], [0.0, 0.2, 5.0]])
VALVE_COST = 0.003
ALLOCATION = ValveAllocation(THRUSTERS, weight=WEIGHT, valve_cost=VALVE_COST)


def costs(command, wanted, thrusters=THRUSTERS):
    force, torque = thrusters.wrench_in_body(command)
    miss = np.concatenate((force[..., :2], torque[..., 2:]), axis=-1) - wanted
    return np.einsum("...i,ij,...j->...", miss, WEIGHT, miss) + VALVE_COST * command.sum(axis=-1)


wrenches = st.tuples(st.floats(-2, 2), st.floats(-2, 2), st.floats(-1, 1)).map(np.array)


@settings(derandomize=True, deadline=None, max_examples=200)
@given(wanted=wrenches)
def test_no_combination_of_valves_is_cheaper(wanted):
    chosen = ALLOCATION.best(wanted)
    assert set(chosen) <= {0.0, 1.0}
    assert costs(chosen, wanted) == pytest.approx(costs(ALL, wanted).min(), abs=1e-12)


@pytest.mark.parametrize("shared", [True, False])
def test_the_same_holds_without_a_shared_line(shared):
    bank = replace(THRUSTERS, shared_pressure=shared)
    allocation = ValveAllocation(bank, weight=WEIGHT, valve_cost=VALVE_COST)
    for wanted in np.random.default_rng(1).normal(size=(50, 3)):
        assert costs(allocation.best(wanted), wanted, bank) == pytest.approx(
            costs(ALL, wanted, bank).min(), abs=1e-12
        )


def test_nothing_wanted_opens_nothing():
    assert not ALLOCATION.best(np.zeros(3)).any()


@pytest.mark.parametrize("valve_cost", [VALVE_COST, 0.0])
def test_of_combinations_with_one_wrench_the_one_with_fewest_valves_is_taken(valve_cost):
    allocation = ValveAllocation(THRUSTERS, weight=WEIGHT, valve_cost=valve_cost)
    force, torque = THRUSTERS.wrench_in_body(ALL)
    wrench = np.round(np.concatenate((force[:, :2], torque[:, 2:]), axis=1), 9)
    for row in np.unique(wrench, axis=0):
        fewest = ALL[np.all(wrench == row, axis=1)].sum(axis=1).min()
        if valve_cost == 0.0 or fewest <= 2:  # with a price, far wrenches may not be worth their valves
            assert allocation.best(row).sum() <= fewest


def test_a_batch_is_answered_like_its_members():
    wanted = np.random.default_rng(2).normal(size=(40, 3))
    together = ALLOCATION.best(wanted)
    assert together.shape == (40, 8)
    np.testing.assert_array_equal(together, [ALLOCATION.best(row) for row in wanted])


def bank_of(count, shared):
    """Nozzles at random places of a disc, in random directions."""
    rng = np.random.default_rng(count)
    place, heading = rng.uniform(0.0, 2.0 * np.pi, (2, count))
    arm = rng.uniform(0.2, 0.4, count)
    nozzles = tuple(
        Nozzle(f"n{i}", (r * np.cos(a), r * np.sin(a), 0.0), (np.cos(d), np.sin(d), 0.0))
        for i, (r, a, d) in enumerate(zip(arm, place, heading, strict=True))
    )
    return replace(THRUSTERS, nozzles=nozzles, shared_pressure=shared)


@pytest.mark.parametrize("shared", [True, False])
@pytest.mark.parametrize("searched", [True, False])
def test_banks_of_14_valves_are_answered_like_all_combinations(searched, shared, monkeypatch):
    """To 16 valves from a table. Beyond it a search finds the best of a shared line, and else nearly the best."""
    if searched:
        monkeypatch.setattr(valve_allocation, "MOST_IN_TABLE", 4096)
    bank = bank_of(14, shared)
    allocation = ValveAllocation(bank, weight=WEIGHT, valve_cost=VALVE_COST)
    assert len(allocation.every[0]) < 4096
    every = np.array(list(itertools.product((0.0, 1.0), repeat=14)))
    wanted = np.random.default_rng(3).normal(size=(40, 3))
    chosen = allocation.best(wanted)
    np.testing.assert_array_equal(chosen, [allocation.best(row) for row in wanted])
    gaps = np.array(
        [costs(v, row, bank) - costs(every, row, bank).min() for v, row in zip(chosen, wanted, strict=True)]
    )
    gaps /= np.einsum("ri,ij,rj->r", wanted, WEIGHT, wanted)  # the cost of doing nothing
    assert np.max(gaps) < (0.1 if searched and not shared else 1e-9)
    assert np.median(gaps) < 1e-9


@pytest.mark.parametrize("count", [16, 24])
@pytest.mark.parametrize("shared", [True, False])
def test_a_dead_valve_of_a_large_bank_stays_closed(count, shared):
    allocation = ValveAllocation(bank_of(count, shared), weight=WEIGHT, valve_cost=VALVE_COST)
    wanted = np.random.default_rng(4).normal(size=(20, 3))
    alive = np.ones((20, count))
    alive[np.arange(20), np.argmax(allocation.best(wanted), axis=-1)] = 0.0
    chosen = allocation.best(wanted, alive, dearer=np.full(20, 0.001))
    assert chosen.any()
    assert not np.any(chosen * (1.0 - alive))
