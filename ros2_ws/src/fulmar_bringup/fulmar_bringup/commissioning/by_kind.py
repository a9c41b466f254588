"""How the wires of actuators are pulsed and named, by their family: those of all others are not."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from fulmar_bringup.commissioning import procedure
from fulmar_bringup.commissioning.hardware_file import propeller_command, valve_command, wheel_command
from fulmar_bringup.commissioning.match import indistinct
from fulmar_bringup.commissioning.procedure import Outcome
from fulmar_core.robots.robot import Robot
from hardware_drivers.wiring import SIDES


def _side(drive: int, sign: float) -> str:
    return f"{'-' if sign < 0 else ''}{SIDES[drive]}"


@dataclass(frozen=True)
class Pulsed:
    """Of one family.

    Attributes:
        measure: Pulses wires; from session, robot, actuators, wires and where words go.
        command: From actuators, a wire and a share: the command that gives this wire alone a positive value.
        key: Of the hardware file's list of wires.
        entry: Of that list, from the number of what a wire drives, and -1 where it works backwards.
        names: Of what wires drive.
        indistinct: Groups of those that no motion distinguishes, from the actuators.
    """

    measure: Callable[..., Outcome]
    command: Callable[..., np.ndarray]
    key: str = "wiring"
    entry: Callable[[int, float], int | str] = _side
    names: Callable[[Robot], Sequence[str]] = lambda robot: robot.actuators.names
    indistinct: Callable[..., list[tuple[str, ...]]] = lambda _actuators: []


PULSED: dict[str, Pulsed] = {
    "thrusters": Pulsed(
        procedure.valves, valve_command, key="order", entry=lambda drive, _sign: drive, indistinct=indistinct
    ),
    "propellers": Pulsed(procedure.propellers, propeller_command),
    "differential_drive": Pulsed(
        procedure.wheels, wheel_command, names=lambda _robot: tuple(f"{side} wheel" for side in SIDES)
    ),
}
