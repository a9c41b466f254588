"""An e-stop holds a run, and ends it only if asked to; the result says that it was pressed."""

from __future__ import annotations

import time
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from fulmar_bags.run_record import HealthSample, read_run
from fulmar_bringup import run_executor
from fulmar_bringup.run_plan import RunPlan
from fulmar_bringup.supervisor import Report
from fulmar_core.config.errors import RunFailed
from fulmar_core.robots.wire_check import BETWEEN, WARNINGS, WIRE_WARNINGS
from fulmar_evaluation.run_summary import summarise, summary_text

PLAN = RunPlan("floating_platform", "go_to_pose", "lqr", "mock", 5.0)
PRESSED = "e-stop: pressed. Reset it: fulmar estop --reset: actuators in their safe state"


class Overseer:
    """Shows the reports of a plant, one after another."""

    def __init__(self, *plants: Report) -> None:
        self._rest = list(plants)
        self.plant = self._rest.pop(0)
        self.controller = Report(received_s=time.monotonic())

    def silent_s(self, report: Report) -> float:
        return 0.0

    def wait_until(self, condition: Any, alive: Any) -> None:
        while not condition():
            alive()
            self.plant = self._rest.pop(0)


def said(level: str, message: str, mode: str = "running") -> Report:
    return Report(level, message, {"mode": mode, "sim_time_s": "1.0"}, time.monotonic())


def wait_for_end(*plants: Report, end_on_estop: bool = False) -> None:
    keeper = SimpleNamespace(look=lambda: None)
    run_executor._wait_for_end(PLAN, Overseer(*plants), keeper, lambda *_: None, end_on_estop=end_on_estop)


def test_an_e_stop_holds_the_run_until_its_time_is_over():
    wait_for_end(said("ok", "running"), said("error", PRESSED), said("ok", "finished", "finished"))


def test_a_run_that_is_asked_to_ends_on_an_e_stop():
    with pytest.raises(RunFailed, match="plant: e-stop: pressed"):
        wait_for_end(said("ok", "running"), said("error", PRESSED), end_on_estop=True)


def test_every_other_error_of_the_plant_ends_the_run():
    with pytest.raises(RunFailed, match="plant: no command"):
        wait_for_end(said("error", PRESSED), said("error", "no command for 500 ms"))


def test_the_result_says_that_the_e_stop_was_pressed_and_what_does_not_fit(reached):
    record = read_run(reached)
    assert summarise(record)["estop_pressed"] is False
    assert summarise(record)["warnings"] == []
    running = {"mode": "running", WIRE_WARNINGS: f"one{BETWEEN}two"}
    samples = (
        HealthSample(1.0, "floating_platform: plant", 2, PRESSED, running),
        HealthSample(2.0, "floating_platform: controller", 1, "two", {WIRE_WARNINGS: "two"}),
    )
    summary = summarise(replace(record, health=record.health + samples))
    assert summary["estop_pressed"] is True
    pressed, *others = summary["warnings"]
    assert "e-stop was pressed" in pressed
    assert others == ["one", "two"]
    assert f"  warning: {pressed}\n  warning: one\n  warning: two\n" in summary_text(summary)


def test_a_press_after_the_plant_has_finished_is_none_of_the_run(reached):
    record = read_run(reached)
    after = HealthSample(9e9, "floating_platform: plant", 1, PRESSED, {"mode": "finished"})
    assert summarise(replace(record, health=(*record.health, after)))["estop_pressed"] is False


def test_the_result_lists_the_warnings_of_every_node_once(reached):
    record = read_run(reached)
    samples = (
        HealthSample(1.0, "floating_platform: estimator", 1, "one", {WARNINGS: "one"}),
        HealthSample(2.0, "floating_platform: estimator", 1, "one", {WARNINGS: f"one{BETWEEN}two"}),
    )
    assert summarise(replace(record, health=record.health + samples))["warnings"] == ["one", "two"]
