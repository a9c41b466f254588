"""The wires of a hardware file, and the command that makes each of them work."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fulmar_core.actuators.differential_drive import DifferentialDrive
from fulmar_core.actuators.thrusters import Thrusters
from fulmar_core.robot import Robot
from hardware_drivers.settings import GpioValves, Hardware, OwnDriver, ValveTopic
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
    if isinstance(driver, OwnDriver) and driver.order:
        return [Wire(f"channel {number}", nozzle) for number, nozzle in enumerate(driver.order)]
    return [
        Wire(f"{channel} channel", SIDES.index(side.removeprefix("-")), -1.0 if side.startswith("-") else 1.0)
        for channel, side in zip(SIDES, driver.wiring, strict=True)
    ]


def command_of(robot: Robot, wire: Wire, level: float = 1.0) -> np.ndarray:
    """The robot's command that gives one wire a positive value and the others none.

    Args:
        robot: The robot.
        wire: Which output.
        level: Share of full thrust of a propeller; wheels and valves know one level.

    Returns:
        Shape (n,).
    """
    actuators = robot.actuators
    if isinstance(actuators, Thrusters):
        return np.eye(len(actuators.names))[wire.actuator]
    sides = np.zeros(2)
    sides[wire.actuator] = wire.sign * (WHEEL_SPEED if isinstance(actuators, DifferentialDrive) else level)
    if isinstance(actuators, DifferentialDrive):
        return np.array([0.5 * sides.sum(), (sides[1] - sides[0]) / actuators.track])
    return sides


def actuator_names(robot: Robot) -> Sequence[str]:
    """What wires can drive: nozzles or propellers by their names, or the wheels."""
    if isinstance(robot.actuators, DifferentialDrive):
        return tuple(f"{side} wheel" for side in SIDES)
    return robot.actuators.names
