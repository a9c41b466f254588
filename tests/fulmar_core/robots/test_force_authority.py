"""How hard valves push in a direction."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from fulmar_core.robots.actuators.force_authority import ForceAuthority
from fulmar_core.robots.robot_file import load_robot

VALVES = load_robot("floating_platform").actuators


@pytest.mark.parametrize(
    ("degrees", "most"), [(45.0, 1.0), (0.0, np.sqrt(0.5)), (90.0, np.sqrt(0.5)), (225.0, 1.0)]
)
def test_valves_that_share_pressure_push_hardest_along_their_nozzles(degrees, most):
    way = np.array([np.cos(np.deg2rad(degrees)), np.sin(np.deg2rad(degrees))])
    assert ForceAuthority(VALVES).along(way, np.zeros(2)) == pytest.approx(most, abs=1e-5)


def test_a_push_adds_along_its_own_direction_and_takes_away_against_it():
    reach, way = ForceAuthority(VALVES), np.array([1.0, 1.0]) / np.sqrt(2.0)
    assert reach.along(way, 0.4 * way) == pytest.approx(1.4, abs=1e-5)
    assert reach.along(way, -0.4 * way) == pytest.approx(0.6, abs=1e-5)
    assert reach.along(way, -1.4 * way) == 0.0


def test_without_shared_pressure_two_nozzles_push_twice_as_hard():
    way = np.array([1.0, 1.0]) / np.sqrt(2.0)
    assert ForceAuthority(replace(VALVES, shared_pressure=False)).along(way, np.zeros(2)) == pytest.approx(
        2.0, abs=1e-5
    )


@pytest.mark.parametrize("direction", [(1.0, 0.0), (0.6, -0.8), (-0.28, 0.96)])
def test_without_shared_pressure_no_combination_pushes_harder_against_a_push(direction):
    bank, way = replace(VALVES, shared_pressure=False), np.array(direction)
    every = np.array(list(itertools.product((0.0, 1.0), repeat=8)))
    forces = bank.wrench_in_body(every)[0][:, :2]
    corners = ConvexHull(forces)
    # Along the way through the hull: the nearest of its sides.
    steep = corners.equations[:, :2] @ way
    most = np.min(-corners.equations[steep > 1e-9, 2] / steep[steep > 1e-9])
    assert ForceAuthority(bank).along(way, np.zeros(2)) == pytest.approx(most, abs=1e-5)


def test_a_bank_of_24_valves_of_one_direction_pushes_nowhere_else():
    nozzles = tuple(replace(VALVES.nozzles[0], name=f"n{i}", direction=(1.0, 0.0, 0.0)) for i in range(24))
    reach = ForceAuthority(replace(VALVES, nozzles=nozzles, shared_pressure=False))
    assert reach.along(np.array([1.0, 0.0]), np.zeros(2)) == pytest.approx(24.0 * VALVES.thrust)
    assert reach.along(np.array([0.0, 1.0]), np.zeros(2)) == pytest.approx(0.0)
    assert not reach.holds(np.array([1.0, 0.0]))
