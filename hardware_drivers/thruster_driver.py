"""Drivers of valves by GPIO, with and without an air bearing."""

from __future__ import annotations

import threading
import time

import numpy as np
from gpiod.line import Value

from fulmar_core.robots.robot import Robot
from hardware_drivers.driver import DeviceDriver
from hardware_drivers.gpio import LineRequest, line_of, output_lines
from hardware_drivers.settings import GpioValves
from hardware_drivers.valves import ValveTiming

STATES = {False: Value.INACTIVE, True: Value.ACTIVE}


class ValveDriver(DeviceDriver):
    """Opens and closes valves by GPIO; measures nothing.

    A supply with a line of its own is open only while valves are to be: a valve that is stuck open then blows no longer
    than until the next rest, whether a controller, a watchdog or an e-stop brought it.
    """

    def __init__(self, robot: Robot, settings: GpioValves, *, patience_s: float) -> None:
        """Take the lines, everything closed.

        Raises:
            DeviceError: The chip or a line is not there.
        """
        self._order = np.array(settings.order)
        self._valves = [line_of(line) for line in settings.lines]
        self._lines: LineRequest | None = output_lines(
            settings.port, settings.every_line, active_low=settings.active_low, patience_s=patience_s
        )
        self._timing = ValveTiming(len(self._valves), settings.min_on_s)
        self._chip = settings.port
        self._written: dict[int | str, Value] = {}  # what each line was set to last
        self._proven: set[tuple[int | str, Value]] = set()  # lines and states that the chip has read back
        self._refusal = self._unread = ""
        self._supply, self._supply_open, self._opened_ns = settings.supply, False, 0
        self._lock = threading.Lock()

    def write(self, command: np.ndarray) -> np.ndarray:
        """Set the valves; see `DeviceDriver`."""
        now_ns = time.monotonic_ns()
        with self._lock:
            self._read_back()
            applied = self._timing.allowed(command, now_ns)
            self._feed(bool(applied.any()), now_ns)
            self._set(applied)
            self._note(bool(applied.any()), now_ns)
        return applied

    def health(self) -> dict[str, str]:
        """Lines that do not read as they were set; see `DeviceDriver`."""
        return {"warning": self._unread}

    def refusal(self) -> str:
        """Whether a line is not as it was set; see `Answering`."""
        return self._refusal

    def close(self) -> None:
        """Close the valves, shut the supply and release the lines; see `DeviceDriver`."""
        with self._lock:
            if self._lines is not None:
                self._rest()
                self._let_go()
                self._lines.release()
                self._lines = None

    def _set(self, valves: np.ndarray) -> None:
        """Bring every valve into its state; call with the lock held."""
        wired = valves[self._order] > 0.5
        self._write({line: STATES[bool(on)] for line, on in zip(self._valves, wired, strict=True)})

    def _write(self, values: dict[int | str, Value]) -> None:
        """Set lines; call with the lock held."""
        if self._lines is not None:
            self._lines.set_values(values)
            self._written |= values

    def _read_back(self) -> None:
        """Compare the lines with what they were set to a tick ago; call with the lock held."""
        if self._lines is None:
            return
        lines = list(self._written)
        try:
            found = self._lines.get_values(lines)
        except OSError:  # a chip that does not read its outputs
            return
        states = [(line, self._written[line], value) for line, value in zip(lines, found, strict=True)]
        self._proven |= {(line, value) for line, written, value in states if value is written}
        wrong = [line for line, written, value in states if value is not written]
        # Of a chip that does not read its outputs, a line never shows both states: that is no fault of the valve.
        off = [line for line in wrong if all((line, state) in self._proven for state in STATES.values())]
        self._refusal = self._named(
            off, "not at the level that was set: a short circuit, or another program?"
        )
        self._unread = self._named([line for line in wrong if line not in off], "not read as it was set")

    def _named(self, lines: list[int | str], what: str) -> str:
        return f"{self._chip}: line {', '.join(map(str, lines))} is {what}" if lines else ""

    def _rest(self) -> None:
        """Close every valve and shut the supply; call with the lock held."""
        self._set(np.zeros(len(self._valves)))
        self._switch_supply(False)

    def _feed(self, used: bool, now_ns: int) -> None:
        """Open the supply before a valve opens, and shut it after a rest; call with the lock held."""
        if self._supply is None:
            return
        if used:
            self._opened_ns = now_ns
            self._switch_supply(True)
        elif now_ns - self._opened_ns >= 1e9 * self._supply.rest_s:
            self._switch_supply(False)

    def _switch_supply(self, on: bool) -> None:
        if self._supply is not None and self._lines is not None and on != self._supply_open:
            self._write({line_of(self._supply.line): STATES[on]})
            self._supply_open = on

    def _note(self, used: bool, now_ns: int) -> None:
        """Called after each command, with whether a valve is open and the steady clock [ns], with the lock held."""

    def _let_go(self) -> None:
        """Called before the lines are released, with the lock held."""


class ThrusterDriver(ValveDriver):
    """Switches the valve of an air bearing as well.

    The bearing is a line like the others, but its service switches it, the start and end of the driver, and a long
    idle time, never a thrust command.
    """

    def __init__(self, robot: Robot, settings: GpioValves, *, patience_s: float) -> None:
        """Take the lines, everything closed; the settings have a bearing.

        Raises:
            DeviceError: The chip or a line is not there.
        """
        super().__init__(robot, settings, patience_s=patience_s)
        assert settings.bearing is not None
        self._settings, self._bearing = settings.bearing, line_of(settings.bearing.line)
        self._bearing_on = False
        self._used_ns = time.monotonic_ns()

    def begin(self, x: float, y: float, heading: float) -> None:
        """Switch the bearing on where the hardware file says so; see `DeviceDriver`."""
        if self._settings.on_at_start:
            self.set_bearing(True)

    def close(self) -> None:
        """Close the valves, switch the bearing off after `linger_s`, and release the lines; see `DeviceDriver`."""
        with self._lock:
            if self._lines is not None:
                self._rest()
        if self._bearing_on:
            time.sleep(self._settings.linger_s)
        super().close()

    def health(self) -> dict[str, str]:
        """Whether it floats; see `DeviceDriver`."""
        return {
            "air_bearing": "on" if self._bearing_on else "off",
            "warning": self._unread if self._bearing_on else "the air bearing is off: the valves stay closed",
        }

    @property
    def bearing_on(self) -> bool:
        """See `AirBearing`."""
        return self._bearing_on

    def set_bearing(self, on: bool) -> str:
        """See `AirBearing`."""
        with self._lock:
            if self._lines is None:
                return "the driver has let go of the lines"
            if not on:
                self._rest()
            self._switch(on)
            self._used_ns = time.monotonic_ns()
        return ""

    def _switch(self, on: bool) -> None:
        """Switch the bearing; call with the lock held."""
        self._write({self._bearing: STATES[on]})
        self._bearing_on = on

    def _let_go(self) -> None:
        """Switch the bearing off; see `ValveDriver`."""
        self._switch(False)

    def _note(self, used: bool, now_ns: int) -> None:
        """Switch the bearing off after a long idle time; see `ValveDriver`."""
        if used:
            self._used_ns = now_ns
        limit_ns = self._settings.idle_off_s * 1e9
        if limit_ns and self._bearing_on and now_ns - self._used_ns > limit_ns:
            self._switch(False)
