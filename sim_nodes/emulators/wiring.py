"""Wiring of an emulated robot, with swapped, reversed and cut wires."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fulmar_core.robots.actuators.differential_drive import DifferentialDrive
from fulmar_core.robots.actuators.thrusters import Thrusters
from fulmar_core.robots.robot import Robot

STRAIGHT = ("left", "right")


class Wiring:
    """Maps the commands of a device's channels to the actuators behind them."""

    def __init__(
        self, robot: Robot, *, order: Sequence[int], sides: Sequence[str], dead: Sequence[int]
    ) -> None:
        """Prepare.

        Args:
            robot: The robot.
            order: Thruster that each valve's wire opens; the device itself follows it, here it finds the dead ones.
            sides: Side that each channel of a base or a boat turns, with a '-' where backwards.
            dead: Wires that are cut, counted from 0.
        """
        self._robot, self._straight = robot, tuple(sides) == STRAIGHT and not dead
        self._dead = [order[wire] for wire in dead] if isinstance(robot.actuators, Thrusters) else list(dead)
        self._sides = [
            (STRAIGHT.index(side.removeprefix("-")), -1.0 if "-" in side else 1.0) for side in sides
        ]

    def applied(self, command: np.ndarray) -> np.ndarray:
        """Commands of the actuators.

        Args:
            command: Of the device, shape (n,).

        Returns:
            Same shape and unit.
        """
        if isinstance(self._robot.actuators, Thrusters):
            applied = command.copy()
            applied[self._dead] = 0.0
            return applied
        if self._straight:
            return command
        if not self._robot.actuators.takes_velocity:
            return self._crossed(command)
        track = self._robot.actuated_by(DifferentialDrive).track
        half = 0.5 * track * command[1]
        left, right = self._crossed(np.array([command[0] - half, command[0] + half]))
        return np.array([0.5 * (left + right), (right - left) / track])

    def _crossed(self, channels: np.ndarray) -> np.ndarray:
        sides = np.zeros(2)
        for channel, (side, sign) in enumerate(self._sides):
            sides[side] = 0.0 if channel in self._dead else sign * channels[channel]
        return sides
