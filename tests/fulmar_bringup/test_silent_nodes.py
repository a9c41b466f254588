"""Nodes that report no more end a run, and it says which and for how long."""

from __future__ import annotations

import time
from dataclasses import replace

import pytest

from fulmar_bringup.run_executor import (
    LOCKSTEP_SILENT_S,
    PLANT_SILENT_S,
    SILENT_S,
    EndWatch,
    _wait_for_end,
    silence_limits_s,
)
from fulmar_bringup.run_plan import RunPlan
from fulmar_bringup.supervisor import Report
from fulmar_core.config.errors import RunFailed

PLAN = RunPlan("floating_platform", "go_to_pose", "lqr", "mujoco", 5.0, duration_s=1.0)


class Overseer:
    """A plant and a controller that reported at some time, and a clock in the test's hand."""

    def __init__(self, *, plant_ago_s: float, controller_ago_s: float) -> None:
        self.now_s = time.monotonic()
        self.plant = Report("ok", "running", {"mode": "running"}, self.now_s - plant_ago_s)
        self.controller = Report("ok", "", {"mode": "active"}, self.now_s - controller_ago_s)

    def silent_s(self, report: Report) -> float:
        return self.now_s - report.received_s

    def since_s(self, moment_s: float) -> float:
        return self.now_s - moment_s

    def wait_until(self, condition, alive) -> None:
        assert not condition()
        alive()
        self.plant = replace(self.plant, values={"mode": "finished"})


class Keeper:
    """Looks after processes that all live."""

    def look(self) -> None:
        pass


def watched(plan: RunPlan, *, plant_ago_s: float = 0.0, controller_ago_s: float = 0.0) -> None:
    overseer = Overseer(plant_ago_s=plant_ago_s, controller_ago_s=controller_ago_s)
    _wait_for_end(plan, overseer, Keeper(), lambda *_: None, end_on_estop=False)


def test_a_plant_that_has_not_reported_for_three_seconds_hangs() -> None:
    """It reports once a second."""
    with pytest.raises(RunFailed, match=r"plant: has not reported for 3\.1 s; it hangs$"):
        watched(PLAN, plant_ago_s=PLANT_SILENT_S + 0.1)


def test_a_controller_that_has_not_reported_for_two_seconds_hangs() -> None:
    with pytest.raises(RunFailed, match=r"controller: has not reported for 2\.1 s; it hangs$"):
        watched(PLAN, controller_ago_s=SILENT_S + 0.1)


def test_nodes_that_reported_a_moment_ago_do_not_hang() -> None:
    watched(PLAN, plant_ago_s=PLANT_SILENT_S - 0.1, controller_ago_s=SILENT_S - 0.1)


def test_a_slow_controller_and_lock_step_have_more_time() -> None:
    assert silence_limits_s(replace(PLAN, control_hz=0.5)) == (PLANT_SILENT_S, 6.0)
    assert silence_limits_s(replace(PLAN, lockstep=True)) == (LOCKSTEP_SILENT_S, LOCKSTEP_SILENT_S)


def test_the_robots_of_a_fleet_in_lock_step_have_more_time_together_and_by_the_clock_no_more() -> None:
    def look(plan: RunPlan, silent_s: float) -> None:
        overseer = Overseer(plant_ago_s=silent_s, controller_ago_s=0.0)
        EndWatch(plan, overseer, Keeper(), end_on_estop=False, patience=3.0).look()

    in_step = replace(PLAN, lockstep=True)
    look(in_step, 2.9 * LOCKSTEP_SILENT_S)
    with pytest.raises(RunFailed, match=r"plant: has not reported for 31\.0 s; it hangs$"):
        look(in_step, 3.1 * LOCKSTEP_SILENT_S)
    with pytest.raises(RunFailed, match=r"plant: has not reported for 3\.1 s; it hangs$"):
        look(PLAN, PLANT_SILENT_S + 0.1)
