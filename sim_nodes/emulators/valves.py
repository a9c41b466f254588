"""Eight valves and a bearing on the pins of a GPIO chip that is a file of levels."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fulmar_core.backend import Sample
from fulmar_core.robot import Robot


class ValveBank:
    """Valves do what their pins say, for ever: nobody closes them when the driver dies."""

    def __init__(self, path: Path, robot: Robot, *, order: tuple[int, ...], active_low: bool) -> None:
        """Make the chip, all pins at rest.

        Args:
            path: The file to make.
            robot: The robot.
            order: Which thruster each pin opens, counted from 0; the bearing's pin comes after them.
            active_low: Whether a valve opens at level 0.
        """
        self._path, self._order, self._open_level = path, np.array(order), int(not active_low)
        self._count = len(robot.actuators.names)
        half_made = path.with_suffix(".new")
        half_made.write_bytes(bytes([1 - self._open_level]) * (self._count + 1))
        half_made.rename(path)  # a driver that waits for it finds all of its pins
        self._file = path.open("rb", buffering=0)
        self.address = f"file://{path}"

    def command(self, now_s: float) -> np.ndarray:
        """See `EmulatedDevice`; a platform without air stands on the floor, whatever its valves do."""
        levels = self.levels()
        valves = np.zeros(self._count)
        if levels[self._count] == self._open_level:
            valves[self._order] = levels[: self._count] == self._open_level
        return valves

    @property
    def air(self) -> bool:
        """Whether the valve of the bearing is open."""
        return bool(self.levels()[self._count] == self._open_level)

    def levels(self) -> np.ndarray:
        """Level at the pin of each valve in the order of the wiring, then at the bearing's, shape (n + 1,)."""
        self._file.seek(0)
        return np.frombuffer(self._file.read(self._count + 1), dtype=np.uint8)

    def report(self, sample: Sample, now_s: float) -> None:
        """Valves report nothing."""

    def close(self) -> None:
        """See `EmulatedDevice`."""
        self._file.close()
        self._path.unlink(missing_ok=True)
