"""Who waits for nodes that never get ready learns what they said last, and when."""

from __future__ import annotations

import time
from types import SimpleNamespace

import pytest

from fulmar_bringup import readiness
from fulmar_bringup.supervisor import Report
from fulmar_core.errors import RunFailed
from fulmar_ros.living_plant import TwinRunError


def test_a_node_that_is_not_received_any_more_is_reported_apart_from_one_that_never_was(monkeypatch):
    monkeypatch.setattr(readiness, "START_TIMEOUT_S", -1.0)
    received = Report(message="no goal yet", received_s=time.monotonic() - 12.0)
    overseer = SimpleNamespace(plant=Report(), controller=received, twins=lambda: [])
    group = SimpleNamespace(ended=lambda: None)
    reported = r"the plant said: nothing; the controller said: no goal yet, 12\.\d s ago\)"
    with pytest.raises(RunFailed, match=reported):
        readiness.while_starting(group, overseer)()


def test_a_controller_that_refused_the_goal_says_why(monkeypatch):
    monkeypatch.setattr(readiness, "START_TIMEOUT_S", -1.0)
    received = Report(
        message="no goal yet", values={"goal_refused": "e-stop: pressed"}, received_s=time.monotonic()
    )
    overseer = SimpleNamespace(plant=Report(), controller=received, twins=lambda: [])
    group = SimpleNamespace(ended=lambda: None)
    reported = r"the controller said: no goal yet \(it refused the goal: e-stop: pressed\), 0\.\d s ago"
    with pytest.raises(RunFailed, match=reported):
        readiness.while_starting(group, overseer)()


def test_a_plant_that_stays_beside_ours_is_another_run_and_one_that_goes_is_none(monkeypatch):
    another, seen = TwinRunError("another run"), []
    clock = SimpleNamespace(now_s=0.0, monotonic=lambda: clock.now_s)

    def sleep(duration_s):
        clock.now_s += duration_s
        if clock.now_s > goes_s:
            seen.clear()

    clock.sleep = sleep
    monkeypatch.setattr(readiness, "time", clock)
    overseer = SimpleNamespace(plant=Report(), controller=Report(), twins=lambda: list(seen))
    alive = readiness.while_starting(SimpleNamespace(ended=lambda: None), overseer)
    seen[:], goes_s = [another], 0.4
    alive()
    seen[:], goes_s = [another], 9.0
    with pytest.raises(TwinRunError):
        alive()
    assert clock.now_s < 1.5


def test_a_process_that_ends_beside_another_run_has_that_for_a_reason():
    seen = iter([[TwinRunError("another run")], []])  # that one ends, too
    overseer = SimpleNamespace(plant=Report(), controller=Report(), twins=lambda: next(seen))
    ended = SimpleNamespace(name="plant", returncode=0, text="plant ended")
    with pytest.raises(TwinRunError, match="another run"):
        readiness.while_starting(SimpleNamespace(ended=lambda: ended), overseer)()
