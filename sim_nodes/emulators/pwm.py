"""Emulated valves on the PWM channels of a chip that is a folder, as in /sys/class/pwm."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from fulmar_core.simulation.backend import Sample

FILES = ("period", "duty_cycle", "enable")


def takes(period_ns: int, duty_ns: int) -> bool:
    """Whether Linux lets a channel have these; it answers EINVAL to others (pwm_apply_state, drivers/pwm/core.c).

    So a new channel, whose period is 0, takes nothing before a period, not even a duty of 0.
    """
    return period_ns > 0 and duty_ns <= period_ns


class PwmBank:
    """Valves that open by the duty of their channel; they keep it when the driver dies.

    Files of a folder cannot refuse a number: a channel stays as it was while its files hold what Linux does not take.
    """

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
        self._openings = dict.fromkeys(self._channels, 0.0)
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
        # The period last: a driver sets it first, so that no half of what it writes looks like a state to refuse.
        enabled, duty_ns, period_ns = (self._number(channel / name) for name in reversed(FILES))
        if takes(period_ns, duty_ns):
            self._openings[channel] = duty_ns / period_ns if enabled else 0.0
        return self._openings[channel]

    def _number(self, file: Path) -> int:
        """What stands in a file; what stood there before while a driver writes it."""
        text = file.read_text(encoding="ascii")
        if text:
            self._values[file] = int(text)
        return self._values[file]
