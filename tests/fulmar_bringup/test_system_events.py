"""Reports of a plant and a controller become events, each once."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import pytest

from fulmar_bringup.system_events import SystemEvents, distance_of, mode_of


@dataclass
class Report:
    level: str = "ok"
    message: str = ""
    values: dict[str, str] = field(default_factory=dict)
    received_s: float = 0.0


class System:
    """Reports that a test changes, and the events they become."""

    def __init__(self) -> None:
        self.plant = Report(values={"mode": "running"})
        self.controller = Report(values={"mode": "armed", "controller": "lqr", "sha256": "a"})
        self.events: list[tuple[str, dict[str, Any]]] = []
        self._look = SystemEvents(lambda event, **fields: self.events.append((event, fields)))
        self._time_s = 0.0

    def after(self, seconds: float, **values: str) -> list[str]:
        """Names of the events when the controller reports some values after a time."""
        self.controller.values |= values
        self._time_s += seconds
        self.controller.received_s = self._time_s
        self.events.clear()
        self._look.look(self.plant, self.controller, self._time_s)
        return [name for name, _ in self.events]


@pytest.fixture
def system() -> System:
    made = System()
    assert made.after(0.0) == []
    return made


def test_a_goal_is_reached_once_the_robot_has_been_there_for_a_second(system):
    assert system.after(1.0, goals_received="1", goal_stamp_ns="0", mode="active") == ["goal"]
    assert system.after(2.0, at_goal="true", goal_distance_m="0.05") == []
    assert system.after(0.5, at_goal="false") == []  # it only passed
    assert system.after(0.5, at_goal="true") == []
    assert system.after(1.0, goal_distance_m="0.021") == ["reached"]
    assert system.events[0][1] == {"time_s": 5.0, "distance_m": 0.021, "after_s": 4.0}
    assert system.after(5.0) == system.after(1.0, at_goal="false") == system.after(9.0, at_goal="true") == []
    assert system.after(1.0, goals_received="2") == ["goal"]
    assert system.after(1.0) == ["reached"]


def test_a_goal_that_is_not_followed_is_a_refused_one_with_the_reason(system):
    far = "goal is 100.0 m away, beyond the geofence of 8 m"
    values = {"goals_received": "1", "goal_stamp_ns": "5", "goal_refused_stamp_ns": "5"}
    assert system.after(1.0, goal_refused=far, **values) == ["goal_refused"]
    assert system.events[0][1]["reason"] == far
    assert system.after(1.0) == []
    assert system.after(1.0, goal_refused="", goals_received="2", goal_stamp_ns="6") == ["goal"]


def test_targets_of_a_path_are_counted_from_each_goal_on(system):
    assert system.after(1.0, goals_received="1", goals_done="0") == ["goal"]
    assert system.after(1.0, goals_done="1") == ["target"]
    assert system.after(1.0, goals_done="3") == ["target"]
    assert system.events[0][1]["done"] == 3
    assert system.after(1.0, goals_received="2", goals_done="0") == ["goal"]
    assert system.after(1.0, goals_done="1") == ["target"]


def test_an_e_stop_holds_until_its_reset_and_is_no_fault(system):
    system.plant.level, system.plant.message = "error", "e-stop: pressed. Reset it: fulmar estop --reset"
    system.controller.level, system.controller.message = "error", "e-stop: pressed"
    assert system.after(1.0) == ["estop"]
    assert mode_of(system.plant, system.controller) == "e-stop"
    assert system.after(1.0, goal_refused="e-stop: pressed", goal_refused_stamp_ns="5") == ["goal_refused"]
    assert system.after(1.0) == []
    system.plant.level, system.plant.message = system.controller.level, system.controller.message = "ok", ""
    assert system.after(1.0) == ["reset"]
    assert mode_of(system.plant, system.controller) == "armed"


def test_a_fault_begins_and_ends_with_its_node(system):
    system.plant.level, system.plant.message = "error", "no command for 400 ms"
    assert system.after(1.0) == []  # the controller does not act yet
    assert system.after(1.0, mode="active") == []  # what the plant reports is older than that
    system.plant.received_s = 3.0
    assert system.after(1.0) == ["fault"]
    assert system.events[0][1]["node"] == "plant"
    assert system.after(1.0) == []
    system.plant.level, system.plant.message = "ok", ""
    assert system.after(1.0) == ["recovered"]


def test_a_swap_and_a_refused_one_are_events(system):
    assert system.after(1.0, sha256="b", swap="done /x") == ["swapped"]
    assert system.events[0][1]["sha256"] == "b"
    assert system.after(1.0, swap="refused /y: it is for 'kingfisher'") == ["swap_refused"]
    assert system.after(1.0) == []


def test_a_distance_is_known_while_there_is_a_goal():
    assert distance_of({"goal_distance_m": "0.250"}) == 0.25
    assert distance_of({"goal_distance_m": "inf"}) is None
    assert distance_of({}) is None
