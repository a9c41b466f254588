"""Backend: the seam between Fulmar and a simulator, a mock or a robot.

The same node runs on any backend; only the constructor argument differs.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol, runtime_checkable

import numpy as np

from fulmar_core.dynamics.things import Poses
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.sensors.imu import ImuSample
from fulmar_core.simulation.episode import Episode
from fulmar_core.states.state import RigidBodyState
from fulmar_core.wires.reading import Reading


@dataclass(frozen=True, slots=True)
class Sample:
    """What a backend reports at one instant."""

    readings: Mapping[str, Reading]  # new ones, by the sensor's name in `robots.sensors.table.SENSORS`
    truth: RigidBodyState | None  # None: not a simulator
    things: Poses = field(default_factory=dict)  # where the task's things are, each (3,)
    stamp_ns: int | None = None  # when it was captured; None: just now, by the clock of who asked [ns]
    applied: np.ndarray | None = None  # (n,) commands of the actuators; None: the very command
    refusal: str = ""  # why a device does not carry out commands now; empty while it does
    more_ticks: int = 0  # physics steps beyond those asked for, in a world that waits for no robot
    # Where the other robots of a fleet are, by name: x, y [m], their rates [m/s], and 1 if driven, else 0, each (5,)
    neighbours: Mapping[str, np.ndarray] = field(default_factory=dict)

    @property
    def odometry(self) -> RigidBodyState | None:
        """Measured motion, without a batch axis; None: another node measures it."""
        value: RigidBodyState | None = self._value("odometry")
        return value

    @property
    def measured(self) -> RigidBodyState:
        """The odometry of a backend that measures it, such as every simulator."""
        odometry = self.odometry
        if odometry is None:
            raise ValueError("this backend does not measure where it is.")
        return odometry

    @property
    def imu(self) -> ImuSample | None:
        """The reading of the inertial unit; None: the robot has none."""
        value: ImuSample | None = self._value("imu")
        return value

    def _value(self, sensor: str) -> Any:
        reading = self.readings.get(sensor)
        return None if reading is None else reading.value


class Backend(Protocol):
    """Anything that can carry out the commands of one robot."""

    robot: Robot

    def reset(self, episode: Episode, *, seed: int, number: int = 0) -> Sample:
        """Begin an episode.

        Args:
            episode: Start, world and obstacles, without a batch axis; real robots begin where they are.
            seed: Seed of the sensor noise.
            number: Number of the episode.

        Returns:
            First sample.
        """
        ...

    def step(self, command: np.ndarray, ticks: int = 1, *, begins: int | None = None) -> Sample:
        """Apply a command for some physics steps.

        Several at once are a control step. One at a time, a command that stays the same goes on as it was.

        Args:
            command: Within the actuators' limits, shape (n,).
            ticks: Number of physics steps, >= 1.
            begins: Physics steps of the control step that begins with this one, 0 within it; None: a control step
                begins with a new command, and after the robot's own control period. Hardware ignores it.

        Returns:
            Sample at their end.
        """
        ...

    def make_safe(self) -> None:
        """Bring the actuators to their safe state at once; time does not move on."""
        ...

    def close(self) -> None:
        """Bring the actuators to their safe state and let go."""
        ...


@runtime_checkable
class AirBearing(Protocol):
    """Air supply that keeps a platform afloat: supervised apart from thrust, never dropped by a missing command."""

    @property
    def bearing_on(self) -> bool:
        """Whether air flows through it."""
        ...

    def set_bearing(self, on: bool) -> str:
        """Switch it; returns why that was refused, or nothing. From any thread."""
        ...
