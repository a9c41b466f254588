"""Interface of a device driver, shipped or a user's own."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, Protocol, runtime_checkable

import numpy as np

from fulmar_core.robots.robot import Robot
from hardware_drivers.feedback import Report


class DeviceDriver(Protocol):
    """Sends commands to one device, and reports what it measures.

    A class that inherits from this one needs `__init__`, `write` and `close` only; any class with the same methods is a
    driver, too.

    The driver node calls `begin` once, then `write` and `read` at every tick (the robot's `timing.physics_dt`, 0.02 s
    for most), from one thread, with commands that have passed the limits, the watchdog and the e-stop. At the end, and
    after any error, it writes the safe command several times and calls `close`. So a driver needs no watchdog, no
    e-stop and no clean-up of its own.

    Errors: any exception ends the node with exit code 1, after the safe command; raise `DeviceError` with what the user
    should do. A `write` or `read` that blocks for more than 0.5 s is reported as hanging. While
    `write` blocks, only a watchdog of the device itself stops it: `device_timeout_s` in the hardware file.
    """

    def __init__(self, robot: Robot, settings: Any, *, patience_s: float) -> None:
        """Connect; the actuators stay, or become, safe.

        Args:
            robot: The robot; `robot.actuators.names` is the order of commands.
            settings: The part `driver` of the hardware file; `OwnDriver` for a user's own.
            patience_s: Wait so long for a device that is not there yet [s].

        Raises:
            DeviceError: The device is not there.
        """

    def begin(self, x: float, y: float, heading: float) -> None:
        """Set the robot's present pose in the frame `odom`.

        Only for devices that measure odometry.

        Args:
            x: East, or ahead at the start [m].
            y: North, or to the left [m].
            heading: Counter-clockwise from x [rad].
        """
        return None

    @abstractmethod
    def write(self, command: np.ndarray) -> np.ndarray | None:
        """Send a command at once, without waiting for an answer.

        Args:
            command: Shape (n,), within the actuators' limits. Valves 0 or 1; propellers shares of full thrust, -1 to 1;
                a differential drive speed [m/s] and turn rate to the left [rad/s]. A user's own driver gets one value
                for each channel, in the `order` or `wiring` of its hardware file.

        Returns:
            What the device was sent, where it differs (a bumper is pressed, a minimum on-time); None: the very command.
        """
        ...

    def read(self) -> Report | None:
        """The newest measurement, without waiting; None where the device measures nothing.

        Raises:
            DeviceError: The device has fallen silent.
        """
        return None

    def health(self) -> dict[str, str]:
        """Health by name: battery, lost bytes; `warning` holds the problem, or nothing.

        Published on `/diagnostics`; called ten times a second, from another thread.
        """
        return {}

    @abstractmethod
    def close(self) -> None:
        """Release the device within 2 s; the safe command was written before. Called once."""
        ...


@runtime_checkable
class Halting(Protocol):
    """What a driver also has whose device goes on moving at the safe command, and can be stopped as a whole."""

    def halt(self) -> None:
        """Stop it where it is, within 0.5 s; called before the safe command, each time that commands end.

        `begin` lets it go on.
        """
        ...


@runtime_checkable
class Answering(Protocol):
    """What a driver also has whose device says whether it does what it is commanded."""

    def refusal(self) -> str:
        """Why the device does not carry out commands now, in words that stay the same meanwhile; empty while it does.

        Called at every tick, after `write`. The plant then holds the safe command, also after the device obeys again,
        until a person gives control back: `fulmar teleop ROBOT --give-back`.
        """
        ...


MEMBERS = ("begin", "write", "read", "health", "close")  # that a class must have
