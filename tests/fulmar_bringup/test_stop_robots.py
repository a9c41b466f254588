"""Who is stopped, and when, where nodes are seen one after another."""

from __future__ import annotations

import time
from types import SimpleNamespace
from typing import Any

import pytest

from fulmar_bringup import estop_robots as module
from fulmar_bringup.estop_robots import robots_to_reset, stop_robots
from fulmar_core.robots.topics import OPERATOR_ACTION


class Seen:
    """A node that sees plants and e-stop nodes from some time on, and notes what is said to them."""

    def __init__(self, plants: dict[str, float], buttons: dict[str, float], *, answers: bool = True) -> None:
        self._began_s = time.monotonic()
        self._plants, self._buttons, self._answers = plants, buttons, answers
        self.said: dict[str, list[float]] = {}  # seconds since the beginning
        self.asked: dict[str, float] = {}

    def _now_s(self) -> float:
        return time.monotonic() - self._began_s

    def get_node_names_and_namespaces(self) -> list[tuple[str, str]]:
        return [("plant", f"/{name}") for name, from_s in self._plants.items() if self._now_s() >= from_s]

    def get_service_names_and_types(self) -> list[tuple[str, list[str]]]:
        return [
            (f"/{name}/estop/{service}", [])
            for service in ("trigger", "reset")
            for name, from_s in self._buttons.items()
            if self._now_s() >= from_s
        ]

    def get_fully_qualified_name(self) -> str:
        return "/seen"

    def create_publisher(self, _kind: Any, topic: str, _qos: Any) -> Any:
        name = topic.split("/")[1]
        if topic.endswith(OPERATOR_ACTION.name):  # who presses is no press
            return SimpleNamespace(publish=lambda _message: None, get_subscription_count=lambda: 0)
        return SimpleNamespace(
            publish=lambda _message: self.said.setdefault(name, []).append(self._now_s()),
            get_subscription_count=lambda: int(name in self._plants),
        )

    def create_client(self, _kind: Any, service: str) -> Any:
        name = service.split("/")[1]

        def call_async(_request: Any) -> Any:
            self.asked[name] = self._now_s()
            answer = SimpleNamespace(success=True, message="pressed")
            return SimpleNamespace(done=lambda: self._answers, result=lambda: answer)

        ready = lambda: self._now_s() >= self._buttons.get(name, float("inf"))  # noqa: E731
        return SimpleNamespace(service_is_ready=ready, call_async=call_async)


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, seconds in {"STAY_S": 0.3, "MISS_S": 0.6, "ANSWER_S": 0.4}.items():
        monkeypatch.setattr(module, name, seconds)
    monkeypatch.setattr(module, "MISS_S", 0.6)


def test_a_robot_is_stopped_when_it_is_seen_and_its_button_is_pressed_when_that_is_seen():
    seen = Seen({"boat": 0.0}, {"boat": 0.2})
    (boat,) = stop_robots(seen, None, find_s=1.0)
    assert (boat.reached, boat.answer) == (True, (True, "pressed"))
    assert seen.said["boat"][0] < 0.1
    assert 0.2 <= seen.asked["boat"] < 0.4


def test_a_robot_without_a_button_is_held_until_none_can_be_expected():
    seen = Seen({"boat": 0.0}, {})
    (boat,) = stop_robots(seen, None, find_s=1.0)
    assert (boat.reached, boat.answer) == (True, None)
    assert seen.said["boat"][-1] > 0.5


def test_robots_that_are_seen_later_are_stopped_too():
    found = stop_robots(Seen({"boat": 0.0, "rover": 0.2}, {"boat": 0.0, "rover": 0.2}), None, find_s=1.0)
    assert [robot.space for robot in found] == ["/boat", "/rover"]


def test_only_the_robot_that_is_named_is_stopped():
    seen = Seen({"boat": 0.0, "rover": 0.0}, {"boat": 0.0, "rover": 0.0})
    assert [robot.space for robot in stop_robots(seen, "rover", find_s=1.0)] == ["/rover"]
    assert "boat" not in seen.said


def test_a_button_that_does_not_answer_keeps_nobody_waiting_for_ever():
    (boat,) = stop_robots(Seen({"boat": 0.0}, {"boat": 0.0}, answers=False), None, find_s=1.0)
    assert (boat.reached, boat.answer) == (True, None)


def test_where_nobody_is_seen_nobody_is_stopped():
    assert stop_robots(Seen({}, {}), None, find_s=0.1) == []


def test_a_robot_is_reset_by_its_node_and_counts_as_without_one_only_after_a_while():
    began_s = time.monotonic()
    seen = Seen({"boat": 0.0, "rover": 0.0}, {"boat": 0.4})
    assert robots_to_reset(seen, None, find_s=1.0) == ({"/boat"}, {"/rover"})
    assert 0.6 <= time.monotonic() - began_s < 1.2


def test_the_robot_that_is_named_is_reset_at_once_where_its_node_is_seen():
    began_s = time.monotonic()
    seen = Seen({"boat": 0.0, "rover": 0.0}, {"boat": 0.0})
    assert robots_to_reset(seen, "boat", find_s=1.0) == ({"/boat"}, set())
    assert time.monotonic() - began_s < 0.3


def test_where_nothing_is_seen_nothing_is_reset():
    assert robots_to_reset(Seen({}, {}), None, find_s=0.1) == (set(), set())
