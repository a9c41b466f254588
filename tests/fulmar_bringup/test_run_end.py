"""What ends a run before its time, and what does not."""

from __future__ import annotations

import time

import pytest

from fulmar_bringup.run_executor import _let_it_land, _wait_for_end
from fulmar_bringup.run_plan import RunPlan
from fulmar_bringup.supervisor import Report
from fulmar_core.actuators.refuge import DOWN
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


class Landing:
    """Plays what a plant's safe controller does, one report for each look."""

    def __init__(self, *does: str, silent_s: float = 0.0) -> None:
        self.does, self._silent_s = list(does), silent_s

    @property
    def plant(self) -> Report:
        now = self.does.pop(0) if len(self.does) > 1 else self.does[0]
        return Report("error", "", {"safe_controller": now}, time.monotonic() - self._silent_s)


class Plants:
    """A plant that lives, or has ended."""

    def __init__(self, code: int | None = None) -> None:
        self._code = code

    def process(self, name: str) -> Plants:
        assert name == "plant"
        return self

    def poll(self) -> int | None:
        return self._code


def test_what_cannot_stop_is_flown_down_before_its_plant_is_stopped():
    landing = Landing("holds its height", "descends", "descends", DOWN)
    _let_it_land(landing, Plants())
    assert landing.does == [DOWN]


@pytest.mark.parametrize(
    ("landing", "plants"),
    [
        (Landing(""), Plants()),
        (Landing("descends"), Plants(-9)),
        (Landing("descends", silent_s=60.0), Plants()),
    ],
    ids=["stands", "plant has ended", "plant hangs"],
)
def test_a_run_does_not_wait_for_a_landing_that_nobody_flies(landing, plants):
    began = time.monotonic()
    _let_it_land(landing, plants)
    assert time.monotonic() - began < 0.5
