"""Who waits for nodes that never get ready learns what they said last, and when."""

from __future__ import annotations

import time
from types import SimpleNamespace

import pytest

from fulmar_bringup import readiness
from fulmar_bringup.supervisor import Report
from fulmar_core.config.errors import RunFailed


def test_a_node_that_is_not_received_any_more_is_reported_apart_from_one_that_never_was(monkeypatch):
    monkeypatch.setattr(readiness, "START_TIMEOUT_S", -1.0)
    received = Report(message="no goal yet", received_s=time.monotonic() - 12.0)
    overseer = SimpleNamespace(plant=Report(), controller=received, refuse_twins=lambda: None)
    group = SimpleNamespace(ended=lambda: None)
    reported = r"the plant said: nothing; the controller said: no goal yet, 12\.\d s ago\)"
    with pytest.raises(RunFailed, match=reported):
        readiness.while_starting(group, overseer)()


def test_a_controller_that_refused_the_goal_says_why(monkeypatch):
    monkeypatch.setattr(readiness, "START_TIMEOUT_S", -1.0)
    received = Report(
        message="no goal yet", values={"goal_refused": "e-stop: pressed"}, received_s=time.monotonic()
    )
    overseer = SimpleNamespace(plant=Report(), controller=received, refuse_twins=lambda: None)
    group = SimpleNamespace(ended=lambda: None)
    reported = r"the controller said: no goal yet \(it refused the goal: e-stop: pressed\), 0\.\d s ago"
    with pytest.raises(RunFailed, match=reported):
        readiness.while_starting(group, overseer)()
