"""Emulated valves on the PWM channels of a chip that is a folder, as in /sys/class/pwm."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from fulmar_core.simulation.backend import Sample

FILES = ("period", "duty_cycle", "enable")


class PwmBank:
    """Valves that open by the duty of their channel; they keep it when the driver dies."""

    def __init__(self, path: Path, *, channels: Sequence[int], order: Sequence[int]) -> None:
        """Make the chip, with all channels off.

        Args:
            path: The folder to make.
            channels: Numbers of the channels, in the order of the wiring.
            order: Which thruster each of them opens, counted from 0.
        """
        self._path, self._order = path, np.array(order)
        self._channels = [path / f"pwm{number}" for number in channels]
        self._values = {channel / name: 0 for channel in self._channels for name in FILES}
        half_made = path.with_suffix(".new")
        for file in self._values:
            place = half_made / file.relative_to(path)
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_text("0", encoding="ascii")
        half_made.rename(path)  # a driver that waits for it finds all of its channels
        self.address = str(path)

    def command(self, now_s: float) -> np.ndarray:
        """See `EmulatedDevice`."""
        openings = np.zeros(len(self._channels))
        openings[self._order] = [self._opening(channel) for channel in self._channels]
        return openings

    def report(self, sample: Sample, now_s: float) -> None:
        """Valves report nothing."""

    def close(self) -> None:
        """See `EmulatedDevice`."""
        shutil.rmtree(self._path, ignore_errors=True)

    def _opening(self, channel: Path) -> float:
        period, duty, enabled = (self._number(channel / name) for name in FILES)
        return min(1.0, duty / period) if enabled and period else 0.0

    def _number(self, file: Path) -> int:
        """What stands in a file; what stood there before while a driver writes it."""
        text = file.read_text(encoding="ascii")
        if text:
            self._values[file] = int(text)
        return self._values[file]
