"""Path of the repository and names of its ROS packages, for tests of its files."""

from __future__ import annotations

from pathlib import Path

import pytest

PACKAGES = [
    "fulmar_bags",
    "fulmar_benchmarks",
    "fulmar_bringup",
    "fulmar_cli",
    "fulmar_console",
    "fulmar_core",
    "fulmar_evaluation",
    "fulmar_ros",
    "hardware_drivers",
    "policy_server",
    "sim_nodes",
]


@pytest.fixture(scope="session")
def repository() -> Path:
    return Path(__file__).resolve().parents[2]
