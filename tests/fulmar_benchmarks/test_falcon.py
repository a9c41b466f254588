"""The benchmark of FALCON-S: what it flies by default, and what it requires of MPPI."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from fulmar_benchmarks.catalogue import choice, rows
from fulmar_benchmarks.falcon.campaign import Falcon, ground_effect, requirements
from fulmar_benchmarks.falcon.cells import SCENARIOS, first_flight
from fulmar_benchmarks.selectors import read_names
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.flight_figures import flight_figures as figures

ROBOT = load_robot("airship_v7")
PUBLISHED = {"rmse_per_axis_m": 0.012}


def request(*controllers, scenarios=(), episodes=10):
    return choice(
        "falcon", tasks="a", controllers=controllers, scenarios=scenarios, episodes=episodes, seed=3
    )


def cells_of(asked):
    return Falcon(asked).cells()


def test_a_controller_that_draws_flies_five_seeds_with_exact_state_and_others_one():
    flown = {(cell.controller, cell.scenario): cell.episodes for cell in cells_of(request("mppi", "pid"))}
    steady = {("pid", scenario): 10 for scenario in ("calm", "light", "severe")}
    assert flown == {("mppi", "exact"): 5, ("pid", "exact"): 1, **steady}
    few = cells_of(request("mppi", scenarios=("exact", "calm"), episodes=2))
    assert [cell.episodes for cell in few] == [2, 2]


def test_the_scenario_all_is_one_and_every_stands_for_all_of_them():
    scenarios = next(each for each in rows()["falcon"].selectors if each.name == "scenarios")
    assert read_names("all", scenarios) == ("all",)
    assert read_names("every", scenarios) == tuple(SCENARIOS)
    assert scenarios.read("usual") == ()


def test_flights_that_hold_a_height_begin_apart_so_exact_state_takes_as_many():
    holding = request("lqi", scenarios=("exact", "calm", "light"))
    holding.tasks = ("hold",)
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
        ("calm", {"altitude_rmse_m": None, "late_altitude_rmse_m": None, "survival": None}, False),
    ],
)
def test_a_policy_must_hold_its_height_and_survive(scenario, change, good):
    held = {"altitude_rmse_m": 0.1, "late_altitude_rmse_m": 0.03, "survival": 1.0, "episodes": 256}
    rows = requirements({"tasks": {"hold": {"policy": {scenario: held | change}}}})
    assert rows
    assert all(row.met for row in rows) is good


@pytest.mark.parametrize(
    ("worst", "survival", "good"),
    [(0.02, 1.0, True), (0.04, 1.0, False), (0.02, 0.8, False), (None, 0.0, False)],
)
def test_mppi_must_stay_within_three_centimetres_with_every_seed(worst, survival, good):
    found = {"rmse_per_axis_m": worst, "rmse_per_axis_worst_m": worst, "survival": survival, "episodes": 5}
    flown = {"mppi": {"exact": found | {"thesis": PUBLISHED}}}
    rows = requirements({"tasks": {"a": flown, "b": flown}})
    assert [(row.name.split(",")[1].strip(), row.met) for row in rows] == [("(a)", good)]


def test_an_lqi_that_could_not_be_flown_is_not_met():
    failed = {"error": "why", "survival": None, "episodes": 0}
    rows = requirements({"tasks": {"a": {"lqi": {"light": failed}}}})
    assert [(row.measured, row.met) for row in rows] == [(None, False)]


def flown(heights, *, lost=(), control_dt=1.0):
    """Flights that hold some heights in turn, shape (flights, steps), those in `lost` in the water."""
    heights = np.asarray(heights, dtype=float)
    touching = np.zeros(heights.shape, dtype=bool)
    touching[list(lost), -1] = True
    return SimpleNamespace(
        position_error=np.abs(heights - 1.0), control_dt=control_dt, z=heights, touching=touching,
        shares=np.full((*heights.shape, 5), 0.4), speed=np.full(heights.shape, 20.0), y=0.0 * heights,
    )  # fmt: skip


def test_figures_count_flights_that_survive_and_pool_their_altitudes():
    off, well, lost = [1.4] * 20, [1.0] * 20, [9.0] * 20
    found = figures(flown([off, well, lost], lost=[2]), "hold", ROBOT)
    assert found["survival"] == pytest.approx(2.0 / 3.0)
    assert found["altitude_rmse_m"] == pytest.approx(0.4 / np.sqrt(2.0))
    assert found["rmse_m"] == pytest.approx(0.2)
    assert found["rmse_per_axis_worst_m"] == pytest.approx(0.4 / np.sqrt(3.0))


def test_the_late_altitude_leaves_the_first_ten_seconds_out():
    found = figures(flown([[2.0] * 10 + [1.0] * 10]), "hold", ROBOT)
    assert found["altitude_rmse_m"] > 0.5
    assert found["late_altitude_rmse_m"] == 0.0


def test_most_flights_must_settle_before_there_is_a_time_of_settling():
    settles, never = [2.0, 1.0, 1.0, 1.0], [2.0] * 4
    assert figures(flown([settles, settles, never]), "hold", ROBOT)["settling_s"] == pytest.approx(1.0)
    assert figures(flown([settles, never, never]), "hold", ROBOT)["settling_s"] is None


def test_energy_per_metre_is_that_of_the_throttles_over_the_speed():
    assert figures(flown([[1.0] * 4]), "hold", ROBOT)["energy_per_m"] == pytest.approx(0.4**2 / 20.0)


def test_a_drawn_flight_ends_where_the_craft_is_lost():
    run = flown([[1.0, 0.9, 0.8, 0.1], [1.0] * 4], lost=[0])
    drawn = first_flight(run, ROBOT)
    assert drawn["time_s"].tolist() == [1.0, 2.0, 3.0]
    assert drawn["height_m"].tolist() == [1.0, 0.9, 0.8]
    assert drawn["energy_s"] == pytest.approx([0.16, 0.32, 0.48])
    assert drawn["surfaces_deg"]["elevator"] == pytest.approx([8.0] * 3)
    assert len(first_flight(flown([[1.0] * 40], control_dt=0.1), ROBOT)["time_s"]) == 20


def test_least_energy_per_metre_is_that_of_some_trim_near_the_cruise():
    ground = ground_effect("airship_v7")
    assert 0.0 < ground["least_energy_per_m"] <= ground["energy_per_m"]
    assert 22.4 <= ground["least_energy_speed"] <= 33.6
