"""A robot whose controller is on another computer, behind a cable that loses and delays."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Any

from fulmar_bringup.benchmark.closed_loops import Command
from fulmar_bringup.faults.two_hosts import ACROSS, Quality, two_hosts
from fulmar_core.controller_settings import MOST_COPIES


@dataclass(frozen=True)
class NetworkCase:
    """A robot, what it is asked to do, and the cable to its controller."""

    name: str
    robot: str
    task: str
    quality: Quality
    copies: int = MOST_COPIES  # of each command

    @contextlib.contextmanager
    def prepared(self, seed: int) -> Iterator[Command]:
        """Two hosts; the run is on one of them, its controller on the other."""
        with two_hosts(seed=seed) as hosts:
            hosts.cable.quality = self.quality
            controller = ("--controller-in", hosts.other, "--copies", str(self.copies))
            yield Command(("ip", "netns", "exec", hosts.robot), controller, ACROSS)

    def about(self) -> dict[str, Any]:
        """The cable."""
        return {**asdict(self.quality), "copies": self.copies}
