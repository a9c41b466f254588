"""What ends a run before its time, and what does not."""

from __future__ import annotations

import time
from dataclasses import replace

import pytest

from fulmar_bringup.node_spec import NodeSpec
from fulmar_bringup.plant_row import plant_spec
from fulmar_bringup.run_executor import _bring_down, _wait_for_end
from fulmar_bringup.run_plan import RunPlan
from fulmar_bringup.supervisor import Report
from fulmar_core.config.errors import RunFailed
from fulmar_core.robots.actuators.refuge import LANDS_S
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

    def silent_s(self, report: Report) -> float:
        return time.monotonic() - report.received_s

    def since_s(self, moment_s: float) -> float:
        return time.monotonic() - moment_s

    def wait_until(self, condition, alive) -> None:
        for level, message in self._reports:
            mode = message if message == "finished" else "running"
            self.plant = Report(level, message, {"mode": mode}, time.monotonic())
            if condition():
                return
            alive()


class Keeper:
    """Looks after processes that all live."""

    def look(self) -> None:
        pass


def watched(mode: str, *reports: tuple[str, str], end_on_estop: bool = False) -> None:
    _wait_for_end(PLAN, Overseer(mode, *reports), Keeper(), lambda *_: None, end_on_estop=end_on_estop)


def stepped(monkeypatch, *times_s: float) -> None:
    """Watch a run in lock step whose plant reports these simulated times, a minute of wall-clock time apart."""
    overseer, now_s = Overseer("active"), [0.0]
    monkeypatch.setattr(time, "monotonic", lambda: now_s[0])

    def wait_until(condition, alive) -> None:
        for time_s in times_s:
            now_s[0] += 60.0
            values = {"mode": "running", "sim_time_s": str(1.0 + time_s)}
            overseer.plant = Report("ok", "running", values, now_s[0])
            overseer.controller.received_s = now_s[0]
            assert not condition()
            alive()

    overseer.wait_until = wait_until
    _wait_for_end(replace(PLAN, lockstep=True), overseer, Keeper(), lambda *_: None, end_on_estop=False)


def test_a_run_in_lock_step_may_take_as_long_as_it_takes(monkeypatch):
    stepped(monkeypatch, *(0.1 * step for step in range(10)))


def test_a_run_in_lock_step_that_stands_still_ends(monkeypatch):
    with pytest.raises(RunFailed, match=r"stands still: 0\.20 s of it were over 20 s of wall-clock time ago"):
        stepped(monkeypatch, 0.1, 0.2, 0.2)


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
        _wait_for_end(PLAN, overseer, Keeper(), lambda *_: None, end_on_estop=False)


def test_an_e_stop_ends_a_run_only_if_asked_to():
    watched("armed", RUNNING, PRESSED, RUNNING, FINISHED)
    with pytest.raises(RunFailed, match="e-stop: pressed"):
        watched("armed", RUNNING, PRESSED, RUNNING, FINISHED, end_on_estop=True)


class Plant:
    """A plant that flies down once it is asked to end, by one look after the other, and then has ended."""

    def __init__(self, *, looks: int = 3, mode: str = "running", silent_s: float = 0.0) -> None:
        self._looks, self._silent_s, self.asked = looks, silent_s, 0
        self.plant = Report(values={"mode": mode}, received_s=time.monotonic())
        self.specs = {"plant": replace(ROW, ends_within_s=20.0)}

    def process(self, name: str) -> Plant:
        assert name == "plant"
        return self

    def ask_to_stop(self, name: str, *, at_once: bool = False) -> None:
        assert name == "plant"
        self.asked += 1
        self.at_once = at_once

    def poll(self) -> int | None:
        self._looks -= 1 if self.asked else 0
        return 0 if self._looks < 0 else None

    def listen(self) -> None:
        pass

    def silent_s(self, report: Report) -> float:
        return self._silent_s


ROW = NodeSpec("plant", "x", "x", "x", "/x")


def test_what_cannot_stop_is_asked_to_land_once_and_is_waited_for():
    plant = Plant()
    _bring_down(plant, plant)
    assert plant.asked == 1
    assert plant.poll() == 0


@pytest.mark.parametrize(
    "plant", [Plant(mode="inactive"), Plant(silent_s=60.0)], ids=["does not run", "hangs"]
)
def test_nobody_waits_for_a_landing_that_nobody_flies(plant):
    began = time.monotonic()
    _bring_down(plant, plant)
    assert time.monotonic() - began < 0.5


def test_ctrl_c_cuts_a_landing_short_and_leaves_the_reason_of_the_end(monkeypatch):
    plant = Plant(looks=1000)
    monkeypatch.setattr("fulmar_bringup.run_executor.time.sleep", interrupt)
    _bring_down(plant, plant)
    assert (plant.asked, plant.at_once) == (2, True)


def interrupt(_seconds: float) -> None:
    raise KeyboardInterrupt


def test_only_the_plant_of_what_cannot_stop_lands():
    aircraft = RunPlan("airship_v7", "fly_hold", "lqi", "mujoco", 50.0)
    lands = [plant_spec(plan).ends_within_s for plan in (aircraft, replace(aircraft, lockstep=True), PLAN)]
    assert lands[0] > LANDS_S
    assert lands[1:] == [0.0, 0.0]
