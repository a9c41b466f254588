"""Copies of bundles, to be damaged."""

from __future__ import annotations

import shutil

import pytest

from fulmar_core.loop.policy_bundle import (
    FORMAT,
    Passport,
    write_bundle,
)
from fulmar_core.tasks.observation import Observer
from tests.policy_server.bundles import (
    ROLLING,
    ROLLING_TASK,
    SHIPPED,
    counting_network,
)


@pytest.fixture
def folder(tmp_path):
    return shutil.copytree(SHIPPED, tmp_path / "bundle")


@pytest.fixture
def remembering(tmp_path):
    """A bundle with memory and continuous commands."""
    network, golden = counting_network()
    passport = Passport(
        FORMAT,
        ROLLING.name,
        ROLLING_TASK.name,
        ROLLING.timing.control_hz,
        Observer(ROLLING, ROLLING_TASK).names,
        ROLLING.actuators.names,
        "continuous",
        tuple(ROLLING.actuators.scale),
        2,
        "",
        "",
    )
    write_bundle(tmp_path / "remembering", network, golden, passport)
    return tmp_path / "remembering"
