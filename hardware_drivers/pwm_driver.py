"""Driver of valves that open by degrees, by the PWM channels of Linux."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np

from fulmar_core.config.errors import DeviceError
from fulmar_core.robots.robot import Robot
from hardware_drivers.driver import DeviceDriver
from hardware_drivers.settings import PwmValves

NS = 1_000_000_000
RETRY_S = 0.05


class PwmValveDriver(DeviceDriver):
    """Opens each valve by the duty of its channel, through the files of a chip in /sys/class/pwm; measures nothing."""

    def __init__(self, robot: Robot, settings: PwmValves, *, patience_s: float) -> None:
        """Take the channels, every valve closed.

        Raises:
            DeviceError: The chip or a channel is not there, or this user may not use it.
        """
        self._order, self._period_ns = np.array(settings.order), round(NS / settings.frequency_hz)
        self._chip, self._refusal = Path(settings.port), ""
        try:
            self._channels = [self._channel(number, patience_s) for number in settings.channels]
            self._duties_ns = [-1] * len(self._channels)
            self._set([0] * len(self._channels))
            for channel in self._channels:
                _write(channel / "period", self._period_ns)
                _write(channel / "enable", 1)
        except OSError as error:
            raise DeviceError(
                f"{self._chip}: {error}. May this user write to the files of the chip?"
            ) from error

    def write(self, command: np.ndarray) -> None:
        """Open each valve as far as is commanded, from 0 to 1; see `DeviceDriver`."""
        self._refusal = self._unlike()
        self._set([round(float(share) * self._period_ns) for share in command[self._order]])

    def refusal(self) -> str:
        """Whether a channel has not the duty that was set; see `Answering`."""
        return self._refusal

    def close(self) -> None:
        """Close the valves and let the channels go; see `DeviceDriver`."""
        self._set([0] * len(self._channels))
        for channel in self._channels:
            _write(channel / "enable", 0)

    def _channel(self, number: int, patience_s: float) -> Path:
        """Folder of a channel, which a chip makes when it is asked for."""
        folder, until_s = self._chip / f"pwm{number}", time.monotonic() + patience_s
        while not self._chip.is_dir() and time.monotonic() < until_s:
            time.sleep(RETRY_S)
        if not self._chip.is_dir():
            raise DeviceError(f"{self._chip}: there is no such PWM chip. `ls /sys/class/pwm` lists them.")
        if not folder.is_dir():
            _write(self._chip / "export", number)
        if not folder.is_dir():
            raise DeviceError(
                f"{self._chip}: the chip has no channel {number}. Correct 'channels' of the file."
            )
        return folder

    def _set(self, duties_ns: list[int]) -> None:
        for at, (channel, duty_ns) in enumerate(zip(self._channels, duties_ns, strict=True)):
            if duty_ns != self._duties_ns[at]:
                _write(channel / "duty_cycle", duty_ns)
                self._duties_ns[at] = duty_ns

    def _unlike(self) -> str:
        """Channels whose duty is not the one that was set, in words; empty where all are."""
        pairs = zip(self._channels, self._duties_ns, strict=True)
        wrong = [channel.name for channel, duty_ns in pairs if _read(channel / "duty_cycle") != duty_ns]
        return (
            f"{self._chip}: {', '.join(wrong)} has not the duty that was set: another program?"
            if wrong
            else ""
        )


def _write(file: Path, number: int) -> None:
    file.write_text(str(number), encoding="ascii")


def _read(file: Path) -> int:
    return int(file.read_text(encoding="ascii"))
