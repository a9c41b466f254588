"""The benchmark of FALCON-S: what it flies by default, and what it requires of MPPI."""

from __future__ import annotations

from dataclasses import replace

import pytest

from fulmar_benchmarks.falcon.campaign import Request, cells_of, requirements

PUBLISHED = {"rmse_per_axis_m": 0.012}


def request(*controllers, random_scenarios=("exact",), episodes=10):
    scenarios = ("exact", "calm", "light")
    return Request("airship_v7", ("a",), controllers, scenarios, random_scenarios, episodes, 3, 1)


def test_a_controller_that_draws_flies_five_seeds_with_exact_state_and_others_one():
    flown = {(cell.controller, cell.scenario): cell.episodes for cell in cells_of(request("mppi", "pid"))}
    assert flown == {("mppi", "exact"): 5, ("pid", "exact"): 1, ("pid", "calm"): 10, ("pid", "light"): 10}
    few = cells_of(request("mppi", random_scenarios=("exact", "calm"), episodes=2))
    assert [cell.episodes for cell in few] == [2, 2]


def test_flights_that_hold_a_height_begin_apart_so_exact_state_takes_as_many():
    holding = replace(request("lqi"), tasks=("hold",))
    assert [cell.episodes for cell in cells_of(holding)] == [10, 10, 10]


@pytest.mark.parametrize(
    ("scenario", "change", "good"),
    [
        ("calm", {}, True),
        ("calm", {"altitude_rmse_m": 0.13}, False),
        ("calm", {"late_altitude_rmse_m": 0.05}, False),
        ("calm", {"survival": 0.98}, False),
        ("light", {"altitude_rmse_m": 0.19, "late_altitude_rmse_m": 0.19, "survival": 0.97}, True),
        ("light", {"altitude_rmse_m": 0.21}, False),
        ("light", {"altitude_rmse_m": None, "survival": 0.0}, False),
    ],
)
def test_a_policy_must_hold_its_height_and_survive(scenario, change, good):
    held = {"altitude_rmse_m": 0.1, "late_altitude_rmse_m": 0.03, "survival": 1.0, "episodes": 256}
    rows = requirements({"tasks": {"hold": {"policy": {scenario: held | change}}}})
    assert rows
    assert all(met for *_, met in rows) is good


@pytest.mark.parametrize(
    ("worst", "survival", "good"),
    [(0.02, 1.0, True), (0.04, 1.0, False), (0.02, 0.8, False), (None, 0.0, False)],
)
def test_mppi_must_stay_within_three_centimetres_with_every_seed(worst, survival, good):
    found = {"rmse_per_axis_m": worst, "rmse_per_axis_worst_m": worst, "survival": survival, "episodes": 5}
    flown = {"mppi": {"exact": found | {"thesis": PUBLISHED}}}
    rows = requirements({"tasks": {"a": flown, "b": flown}})
    assert [(name.split(",")[1].strip(), met) for name, *_, met in rows] == [("(a)", good)]
