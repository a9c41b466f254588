"""The launchers that people use, started for a test that harms one of their processes."""

from __future__ import annotations

import signal
from pathlib import Path

import pytest

from fulmar_bringup.launched_command import launched
from fulmar_core.config.errors import DONE
from tests.conftest import RosDomain


@pytest.mark.slow
def test_a_launched_system_names_its_processes_and_events_and_leaves_none(
    ros_domain: RosDomain, tmp_path: Path
) -> None:
    words = ("up", "mock_lqr", "--json", "--record", "bag")
    with launched(words, environment=ros_domain.env, folder=tmp_path) as command:
        command.wait_for_event("started")
        assert {"plant", "controller", "recorder", "markers"} == set(command.nodes())
        command.process.send_signal(signal.SIGTERM)
        assert command.wait(20.0) == DONE
        assert command.wait_for_event("stopped")["failure"] is None
        assert command.left_over() == []
