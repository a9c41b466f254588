"""What ends a run before its time, and what does not."""

from __future__ import annotations

import time

import pytest

from fulmar_bringup.run_executor import _wait_for_end
from fulmar_bringup.run_plan import RunPlan
from fulmar_bringup.supervisor import Report
from fulmar_core.errors import RunFailed
from fulmar_core.safety.watchdog import NO_COMMAND

PLAN = RunPlan("floating_platform", "go_to_pose", "lqr", "mujoco", 5.0, duration_s=1.0)
RUNNING, FINISHED = ("ok", "running"), ("ok", "finished")
TRIPPED = ("error", f"{NO_COMMAND} 493 ms (limit 400 ms): actuators in their safe state")
PRESSED = ("error", "e-stop: pressed. Reset it: fulmar estop --reset: actuators in their safe state")


class Overseer:
    """Plays the reports of a plant one after another, beside a controller in one mode."""

    def __init__(self, mode: str, *reports: tuple[str, str]) -> None:
        self._reports = reports
        self.plant = Report()
        self.controller = Report(values={"mode": mode}, received_s=time.monotonic())

    def wait_until(self, condition, alive) -> None:
        for level, message in self._reports:
            mode = message if message == "finished" else "running"
            self.plant = Report(level, message, {"mode": mode}, time.monotonic())
            if condition():
                return
            alive()


class Group:
    """Processes that all live."""

    def ended(self) -> None:
        return None


def watched(mode: str, *reports: tuple[str, str], end_on_estop: bool = False) -> None:
    _wait_for_end(PLAN, Overseer(mode, *reports), Group(), lambda *_: None, end_on_estop=end_on_estop)


def test_a_late_command_ends_a_run_that_acts():
    with pytest.raises(RunFailed, match="no command for 493 ms"):
        watched("active", RUNNING, TRIPPED, FINISHED)


def test_a_late_command_of_a_controller_that_waits_ends_nothing():
    """As before the air bearing is on."""
    watched("armed", RUNNING, TRIPPED, RUNNING, FINISHED)


def test_an_error_of_the_plant_ends_a_run_also_if_a_command_takes_it_back_at_once():
    overseer = Overseer("active", RUNNING, TRIPPED, FINISHED)

    def wait_until(condition, alive) -> None:
        Overseer.wait_until(overseer, condition, alive)
        overseer.plant = Report("ok", "running", {"mode": "running"}, time.monotonic())

    overseer.wait_until = wait_until
    with pytest.raises(RunFailed, match="no command for 493 ms"):
        _wait_for_end(PLAN, overseer, Group(), lambda *_: None, end_on_estop=False)


def test_an_e_stop_ends_a_run_only_if_asked_to():
    watched("armed", RUNNING, PRESSED, RUNNING, FINISHED)
    with pytest.raises(RunFailed, match="e-stop: pressed"):
        watched("armed", RUNNING, PRESSED, RUNNING, FINISHED, end_on_estop=True)
