"""Output lines of a GPIO chip by libgpiod, or of a file that emulates a chip."""

from __future__ import annotations

import mmap
import os
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

import gpiod
from gpiod.line import Direction, Value

from fulmar_core.config.errors import DeviceError

CONSUMER = "fulmar"
RETRY_S = 0.1
FILE_CHIP = "file://"  # prefix of an address: a file with one byte a line, the level at the pin


class LineRequest(Protocol):
    """Requested lines: the part of `gpiod.LineRequest` that is used."""

    def set_values(self, values: dict[int | str, Value]) -> None:
        """Make lines active or inactive; the request decided which level that is."""
        ...

    def get_values(self, lines: list[int | str]) -> list[Value]:
        """Whether lines are active, as the chip reads them; raises OSError where it cannot."""
        ...

    def release(self) -> None:
        """Release the lines."""
        ...


RequestLines = Callable[..., LineRequest]


def output_lines(
    address: str, lines: Sequence[str], *, active_low: bool, patience_s: float = 0.0
) -> LineRequest:
    """Take lines as outputs, all inactive from the first moment on.

    Args:
        address: A chip, such as /dev/gpiochip0; or `file://` and a path, see `FILE_CHIP`.
        lines: Names or numbers of the lines.
        active_low: Whether a line is active when its pin is low.
        patience_s: Wait so long for a chip that is not there yet [s].

    Raises:
        DeviceError: There is no such chip or line, or another process has it.
    """
    settings = gpiod.LineSettings(
        direction=Direction.OUTPUT, active_low=active_low, output_value=Value.INACTIVE
    )
    request: RequestLines = gpiod.request_lines
    if address.startswith(FILE_CHIP):
        request = request_of_file
    until = time.monotonic() + patience_s
    while True:
        try:
            return request(address, consumer=CONSUMER, config={tuple(map(line_of, lines)): settings})
        except (OSError, ValueError) as error:
            if not isinstance(error, FileNotFoundError) or time.monotonic() > until:
                raise DeviceError(
                    f"{address}: lines {', '.join(lines)} cannot be taken ({error}). "
                    "`gpioinfo` shows the names and numbers of all lines, and their users."
                ) from error
        time.sleep(RETRY_S)


def line_of(text: str) -> int | str:
    """A line in libgpiod's type: numbers as integers."""
    return int(text) if text.isdecimal() else text


def request_of_file(address: str, *, consumer: str, config: Mapping[Any, gpiod.LineSettings]) -> LineRequest:
    """`gpiod.request_lines` for a chip that is a file.

    Its bytes stay when the process that set them dies, as the pins of many chips do.
    """
    return FileLines(Path(address.removeprefix(FILE_CHIP)), config)


class FileLines:
    """Lines of a chip that is a file: one byte for each, in the order of the request."""

    def __init__(self, path: Path, config: Mapping[Any, gpiod.LineSettings]) -> None:
        """Map the file and put every line into its first state; raises OSError where there is none."""
        self._settings = {line: settings for lines, settings in config.items() for line in lines}
        with path.open("r+b") as file:
            if os.fstat(file.fileno()).st_size < len(self._settings):
                raise OSError(f"it has fewer than {len(self._settings)} bytes")
            self._levels = mmap.mmap(file.fileno(), 0)
        self._offsets = {line: offset for offset, line in enumerate(self._settings)}
        self.set_values({line: settings.output_value for line, settings in self._settings.items()})

    def set_values(self, values: dict[int | str, Value]) -> None:
        """See `LineRequest`."""
        for line, value in values.items():
            active = value is Value.ACTIVE
            self._levels[self._offsets[line]] = int(active != self._settings[line].active_low)

    def get_values(self, lines: list[int | str]) -> list[Value]:
        """See `LineRequest`."""
        high = [bool(self._levels[self._offsets[line]]) for line in lines]
        active = [level != self._settings[line].active_low for line, level in zip(lines, high, strict=True)]
        return [Value.ACTIVE if each else Value.INACTIVE for each in active]

    def release(self) -> None:
        """See `LineRequest`."""
        self._levels.close()
