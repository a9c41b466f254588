"""Fleets in one MuJoCo world without ROS: they arrive, they touch without their guard, and not with it."""

from __future__ import annotations

import pytest

from fulmar_bringup.fleet_plan import FleetChoices, fleet_plan
from fulmar_evaluation.fleet_rollout import FleetPaths, roll_out_fleet


def rolled(name: str, *, seed: int, duration_s: float, keep_apart: bool = True) -> FleetPaths:
    choices = FleetChoices(seed=seed, lockstep=True, duration_s=duration_s, keep_apart=keep_apart)
    return roll_out_fleet(fleet_plan(name, choices))


def test_robots_that_run_into_each_other_touch_and_do_not_pass_through() -> None:
    free = rolled("swap_places", seed=4, duration_s=8.0, keep_apart=False)
    assert -0.05 < free.least_m < 0.01
    assert not any(path.held for path in free.robots.values())


def test_the_guard_keeps_the_same_robots_apart() -> None:
    kept = rolled("swap_places", seed=4, duration_s=8.0)
    assert kept.least_m > 0.05
    assert any(path.held for path in kept.robots.values())


@pytest.mark.slow
def test_two_platforms_and_a_boat_reach_three_goals_each() -> None:
    found = rolled("fleet", seed=1, duration_s=60.0)
    assert found.all_arrived and found.least_m > 0.1
    assert len(found.robots["boat"].poses) == 600
