"""Wires of a hardware file: the command that makes each work, and the order or wiring that was found, as a line."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fulmar_core.config.atomic_write import write_whole
from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.actuators.differential_drive import DifferentialDrive
from fulmar_core.robots.actuators.family import Actuators
from hardware_drivers.hardware import Hardware
from hardware_drivers.settings import GpioValves, ValveTopic
from hardware_drivers.wiring import SIDES

WHEEL_SPEED = 0.1  # of the rim of one wheel, our value: a step of some centimetres [m/s]


@dataclass(frozen=True)
class Wire:
    """One output of a device."""

    name: str  # as the hardware file or the protocol calls it
    actuator: int  # index of what the hardware file says it drives
    sign: float = 1.0  # -1: the hardware file says that it works backwards


def wires_of(hardware: Hardware) -> list[Wire]:
    """The outputs of a hardware file's device, in the order of its `order` or `wiring`."""
    driver = hardware.driver
    if isinstance(driver, GpioValves):
        return [Wire(f"line {line}", nozzle) for line, nozzle in zip(driver.lines, driver.order, strict=True)]
    if isinstance(driver, ValveTopic):
        return [Wire(f"value {number}", nozzle) for number, nozzle in enumerate(driver.order, start=1)]
    if order := getattr(driver, "order", ()):
        return [Wire(f"channel {number}", nozzle) for number, nozzle in enumerate(order)]
    wiring = getattr(driver, "wiring", ())
    assert wiring  # there are no pulses for aircraft
    return [
        Wire(f"{channel} channel", SIDES.index(side.removeprefix("-")), -1.0 if side.startswith("-") else 1.0)
        for channel, side in zip(SIDES, wiring, strict=True)
    ]


def valve_command(valves: Actuators, wire: Wire, _level: float = 1.0) -> np.ndarray:
    """The command, shape (n,), that opens the valve of one wire."""
    return np.eye(len(valves.names))[wire.actuator]


def propeller_command(_propellers: Actuators, wire: Wire, level: float = 1.0) -> np.ndarray:
    """The command, shape (2,), that gives one wire a positive share of full thrust, and the other none."""
    sides = np.zeros(2)
    sides[wire.actuator] = wire.sign * level
    return sides


def wheel_command(wheels: DifferentialDrive, wire: Wire, _level: float = 1.0) -> np.ndarray:
    """The command, shape (2,), that turns the wheel of one wire ahead, at the one speed that is used."""
    sides = propeller_command(wheels, wire, WHEEL_SPEED)
    return np.array([0.5 * sides.sum(), (sides[1] - sides[0]) / wheels.track])


def line_of(key: str, values: Sequence[object]) -> str:
    """The line to write, such as `order: [5, 1, 3, 7, 0, 4, 6, 2]`."""
    return f"{key}: [{', '.join(map(str, values))}]"


def with_line(text: str, key: str, values: Sequence[object]) -> str:
    """Text of a hardware file with other values of `order` or `wiring`, below `driver`.

    Everything else stays, comments too, but for the comment behind the replaced value.

    Raises:
        ConfigError: The file is written in a way that no line can be replaced in.
    """
    new = line_of(key, values)
    in_line = re.compile(rf"(?<![\w-]){key}:[ \t]*(\[[^\]\n]*\]|[\w-]+)")
    found = list(in_line.finditer(_without_comments(text)))
    if len(found) == 1:
        begin, end = found[0].span()
        rest = text[end:]
        comment = re.match(r"[ \t]*#[^\n]*", rest)
        return text[:begin] + new + (rest[comment.end() :] if comment else rest)
    block = re.search(r"^(?P<indent>[ \t]+)kind:[^\n]*\n", text, re.MULTILINE)
    if found or block is None or re.search(rf"^\s*{key}:", text, re.MULTILINE):
        raise ConfigError(f"the file has no single-line '{key}' to replace. Write into it: {new}")
    return f"{text[: block.end()]}{block['indent']}{new}\n{text[block.end() :]}"


def write_line(source: Path, target: Path, key: str, values: Sequence[object]) -> None:
    """Write `with_line` of one file to another, or to the same; errors as in `with_line`, and OSError."""
    try:
        text = with_line(source.read_text(encoding="utf-8"), key, values)
    except ConfigError as error:
        raise ConfigError(f"{source}: {error}") from error
    write_whole({target: text.encode()})


def _without_comments(text: str) -> str:
    """The text with comments blanked, of the same length."""
    return re.sub(r"(^|\s)#[^\n]*", lambda match: match[1] + " " * (len(match[0]) - len(match[1])), text)
