"""What tests of whole ROS processes share: a DDS domain of their own."""

from __future__ import annotations

import fcntl
import os
import random
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

# Domains 0 to 101 keep their ports below the range that Linux hands out to others.
DOMAINS = range(102)


@dataclass(frozen=True)
class RosDomain:
    """A DDS domain that no other running test shares, on this host only."""

    id: int
    env: dict[str, str]  # environment of every process that shall see it


@pytest.fixture
def ros_domain(monkeypatch: pytest.MonkeyPatch) -> Iterator[RosDomain]:
    """Give this test a domain; the test's own process gets its variables too."""
    locks = Path(tempfile.gettempdir()) / f"fulmar_ros_domains_{os.getuid()}"
    locks.mkdir(exist_ok=True)
    # A lock file for each domain keeps apart the workers of this run and the runs of this machine.
    for number in random.sample(DOMAINS, len(DOMAINS)):
        with (locks / str(number)).open("w") as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                continue
            own = {"ROS_DOMAIN_ID": str(number), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
            for name, value in own.items():
                monkeypatch.setenv(name, value)
            yield RosDomain(number, {**os.environ, **own})
            return
    pytest.fail("every ROS domain is taken by another test")
