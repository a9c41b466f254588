"""Closed loops through emulated devices: driver, protocol, controller, recorder and safety, in real time."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from fulmar_bringup.benchmark.closed_loops import Command
from fulmar_core.errors import UnknownNameError
from hardware_drivers.settings import MavlinkBoat, load_hardware


@dataclass(frozen=True)
class HardwareCase:
    """A device and what it is asked to do."""

    name: str  # of a file in configs/hardware
    task: str

    @property
    def robot(self) -> str:
        """Whose device it is."""
        return load_hardware(self.name).robot

    def prepared(self, _seed: int) -> contextlib.AbstractContextManager[Command]:
        """An emulator stands in for the device."""
        arm = ("--arm",) if isinstance(load_hardware(self.name).driver, MavlinkBoat) else ()
        device = ("--backend", "hardware", "--hardware", self.name, "--emulate", *arm)
        return contextlib.nullcontext(Command((), device, {}))

    def about(self) -> dict[str, Any]:
        """The device and what drives it."""
        return {"hardware": self.name, "driver": load_hardware(self.name).driver.kind}


CASES = (
    HardwareCase("zero_g_lab", "go_to_pose"),
    HardwareCase("turtlebot2", "go_to_position"),
    HardwareCase("kingfisher", "go_to_position"),
    HardwareCase("kingfisher_ardupilot", "go_to_position"),
)


def cases_of(names: Iterable[str] | None) -> list[HardwareCase]:
    """The cases of some hardware files, or all.

    Raises:
        UnknownNameError: A file has none.
    """
    if names is None:
        return list(CASES)
    known = {case.name: case for case in CASES}
    for name in names:
        if name not in known:
            raise UnknownNameError("emulated device", name, known)
    return [known[name] for name in names]
