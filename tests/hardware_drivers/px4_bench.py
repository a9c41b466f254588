"""An emulated PX4 on the bench and its drivers, without ROS: messages are built from the vendored definitions."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

import fulmar_bringup
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.safety.command_end import CommandEnd
from fulmar_core.simulation.backend import Sample
from hardware_drivers.driver_backend import EndTakingDriverBackend, backend_of
from hardware_drivers.px4_driver import Px4ThrusterDriver
from hardware_drivers.px4_settings import Px4Failsafe, Px4Thrusters
from sim_nodes.emulators.px4 import Px4Emulator
from tests.hardware_drivers.bench import Bench, episode_at

DEFINITIONS = Path(fulmar_bringup.__file__).parent / "px4_msgs" / "msg"
START = (1.0, -0.5, 0.7)
ORDER = tuple(range(8))
BY_SILENCE = Px4Failsafe("disarm", "silence", loss_s=0.4)
BY_HAND = Px4Failsafe("disarm", "set_by_hand", loss_s=0.4)


def fields_of(kind: str) -> list[tuple[str, str]]:
    """Type and name of each field of a message."""
    lines = (line.split("#")[0].strip() for line in (DEFINITIONS / f"{kind}.msg").read_text().splitlines())
    return [(line.split()[0], line.split()[1]) for line in lines if line and "=" not in line]


def message(kind: str, fields: Mapping[str, Any]) -> SimpleNamespace:
    """A message of these fields, the others 0; names and lengths are those of the definition."""
    made = SimpleNamespace()
    known = fields_of(kind)
    assert set(fields) <= {name for _, name in known}, f"{kind} has no {set(fields) - {n for _, n in known}}"
    for type_name, name in known:
        base, _, length = type_name.partition("[")
        zero: Any = False if base == "bool" else 0.0 if base.startswith("float") else 0
        value = fields.get(name, [zero] * int(length[:-1]) if length else zero)
        assert not length or len(value) == int(length[:-1]), f"{kind}.{name} has {len(value)} values"
        setattr(made, name, value)
    return made


class Ends:
    """Two ends of a wire in memory."""

    def __init__(self) -> None:
        self.driver, self.px4 = End(), End()
        self.driver.other, self.px4.other = self.px4, self.driver


class End:
    """One end: gives messages to the other at once."""

    def __init__(self) -> None:
        self.other: End | None = None
        self.receive: Callable[[str, Any], None] = lambda _kind, _message: None
        self.sent: list[tuple[str, Mapping[str, Any]]] = []
        self.closed = False

    def listen(self, receive: Callable[[str, Any], None]) -> None:
        self.receive = receive

    def send(self, kind: str, fields: Mapping[str, Any]) -> None:
        self.sent.append((kind, fields))
        if not self.closed and self.other is not None and not self.other.closed:
            self.other.receive(kind, message(kind, fields))

    def close(self) -> None:
        self.closed = True


@contextlib.contextmanager
def flyer(robot: str = "modular_freeflyer", order: tuple[int, ...] = ORDER) -> Iterator[tuple[Bench, Ends]]:
    """A free flyer behind PX4, switched on."""
    ends = Ends()

    def make(_backend: object) -> Px4Emulator:
        made = Px4Emulator(load_robot(robot), order, wing=False)
        made.parameters.values["COM_OF_LOSS_T"] = 0.4
        made.connect(ends.px4)
        return made

    bench = Bench(robot, make, start=START)
    try:
        yield bench, ends
    finally:
        bench.stop()


@contextlib.contextmanager
def driven(
    bench: Bench, ends: Ends, *, order: tuple[int, ...] = ORDER, begin: bool = True, **more: Any
) -> Iterator[EndTakingDriverBackend]:
    """A driver that has armed it; `more` are settings."""
    settings = replace(Px4Thrusters("px4_thrusters", BY_HAND, order, arm=True), **more)
    driver = Px4ThrusterDriver(bench.robot, settings, ends.driver, patience_s=2.0)
    made = backend_of(bench.robot, driver)
    assert isinstance(made, EndTakingDriverBackend)
    try:
        if begin:
            made.reset(episode_at(bench.robot, *START), seed=0)
        yield made
    finally:
        made.close()


def drive(
    driver: EndTakingDriverBackend, command: np.ndarray, seconds: float, end: CommandEnd = CommandEnd.NONE
) -> Sample:
    """Step at 50 Hz as the plant does, with why commands end."""
    until_s = time.monotonic() + seconds
    while True:
        driver.take_end(end)
        sample = driver.step(np.asarray(command, dtype=float))
        time.sleep(0.02)
        if time.monotonic() >= until_s:
            return sample


def opened(*thrusters: int, count: int = 8) -> np.ndarray:
    """A command that opens some thrusters."""
    command = np.zeros(count)
    command[list(thrusters)] = 1.0
    return command
