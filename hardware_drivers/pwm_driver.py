"""Driver of valves that open by degrees, by the PWM channels of Linux."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from contextlib import suppress
from functools import partial
from pathlib import Path

import numpy as np

from fulmar_core.config.errors import DeviceError
from fulmar_core.robots.robot import Robot
from hardware_drivers.driver import DeviceDriver
from hardware_drivers.settings import PwmValves

NS = 1_000_000_000
RETRY_S = 0.05
UNKNOWN = -1  # a duty that no command equals, so that the next one is written


class PwmValveDriver(DeviceDriver):
    """Opens each valve by the duty of its channel, through the files of a chip in /sys/class/pwm; measures nothing."""

    def __init__(self, robot: Robot, settings: PwmValves, *, patience_s: float) -> None:
        """Take the channels, every valve closed.

        Raises:
            DeviceError: The chip or a channel is not there, or this user may not use it.
        """
        self._order, self._period_ns = np.array(settings.order), round(NS / settings.frequency_hz)
        self._chip, self._refusal = Path(settings.port), ""
        until_s = time.monotonic() + patience_s
        try:
            self._channels = [self._channel(number, until_s) for number in settings.channels]
            self._duties_ns = [UNKNOWN] * len(self._channels)
            _permitted(self._begin, until_s)
        except OSError as error:
            raise DeviceError(
                f"{self._chip}: {error}. May this user write to the files of the chip?"
            ) from error

    def write(self, command: np.ndarray) -> None:
        """Open each valve as far as is commanded, from 0 to 1, also where another one fails; see `DeviceDriver`."""
        duties_ns = [round(float(share) * self._period_ns) for share in command[self._order]]
        try:
            _do_all(partial(self._set, at, duty_ns) for at, duty_ns in enumerate(duties_ns))
        finally:
            self._refusal = self._unlike()

    def refusal(self) -> str:
        """Whether a channel has not the duty that was set; see `Answering`."""
        return self._refusal

    def close(self) -> None:
        """Close the valves and let the channels go; see `DeviceDriver`."""
        self._duties_ns = [UNKNOWN] * len(self._channels)
        shut = [partial(self._set, at, 0) for at in range(len(self._channels))]
        _do_all([*shut, *(partial(_write, channel / "enable", 0) for channel in self._channels)])

    def _channel(self, number: int, until_s: float) -> Path:
        """Folder of a channel, which a chip makes when it is asked for."""
        folder = self._chip / f"pwm{number}"
        while not self._chip.is_dir() and time.monotonic() < until_s:
            time.sleep(RETRY_S)
        if not self._chip.is_dir():
            raise DeviceError(f"{self._chip}: there is no such PWM chip. `ls /sys/class/pwm` lists them.")
        if not folder.is_dir():
            _permitted(partial(_write, self._chip / "export", number), until_s)
        if not folder.is_dir():
            raise DeviceError(
                f"{self._chip}: the chip has no channel {number}. Correct 'channels' of the file."
            )
        return folder

    def _begin(self) -> None:
        """Start every channel with its valve closed; where one fails, all are closed and off."""
        try:
            _do_all(partial(self._start, at) for at in range(len(self._channels)))
        except OSError:
            with suppress(OSError):
                self.close()
            raise

    def _start(self, at: int) -> None:
        """Close a valve, then set the period and turn its channel on.

        Linux refuses every state with a period of 0, which a new channel has, or with a duty above the period
        (`pwm_apply_state` in drivers/pwm/core.c).
        """
        channel = self._channels[at]
        if _read(channel / "period") != 0:
            _write(channel / "duty_cycle", 0)
        _write(channel / "period", self._period_ns)
        self._set(at, 0)
        _write(channel / "enable", 1)

    def _set(self, at: int, duty_ns: int) -> None:
        """Write the duty of a channel, unless it is known to have it."""
        if duty_ns != self._duties_ns[at]:
            self._duties_ns[at] = UNKNOWN
            _write(self._channels[at] / "duty_cycle", duty_ns)
            self._duties_ns[at] = duty_ns

    def _unlike(self) -> str:
        """Channels whose duty is not the one that was set, in words; empty where all are.

        Their duty is unknown from then on, so that the next command is written even if it is the last one again.
        """
        wrong = []
        for at, channel in enumerate(self._channels):
            if _read(channel / "duty_cycle") != self._duties_ns[at]:
                self._duties_ns[at] = UNKNOWN
                wrong.append(channel.name)
        return (
            f"{self._chip}: {', '.join(wrong)} has not the duty that was set: another program?"
            if wrong
            else ""
        )


def _do_all(actions: Iterable[Callable[[], None]]) -> None:
    """Do every action, also after one that failed; then raises the first OSError."""
    failures = []
    for action in actions:
        try:
            action()
        except OSError as error:
            failures.append(error)
    if failures:
        raise failures[0]


def _permitted(action: Callable[[], None], until_s: float) -> None:
    """Do it, again and again while this user may not: udev sets the rights of new files some 100 ms later."""
    while True:
        try:
            return action()
        except PermissionError:
            if time.monotonic() > until_s:
                raise
        time.sleep(RETRY_S)


def _write(file: Path, number: int) -> None:
    file.write_text(str(number), encoding="ascii")


def _read(file: Path) -> int | None:
    """The number in a file; None where it cannot be read."""
    try:
        return int(file.read_text(encoding="ascii"))
    except (OSError, ValueError):
        return None
