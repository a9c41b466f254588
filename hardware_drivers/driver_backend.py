"""A device driver as a `Backend`: safe stop, and no two calls at once."""

from __future__ import annotations

import threading
import time

import numpy as np

from fulmar_core.config.errors import DeviceError
from fulmar_core.robots.actuators.refuge import slowdown
from fulmar_core.robots.robot import Robot
from fulmar_core.safety.command_end import CommandEnd, TakesEnds
from fulmar_core.simulation.backend import AirBearing, Sample
from fulmar_core.simulation.episode import Episode
from fulmar_core.states.planar import PlanarState
from hardware_drivers.driver import Answering, DeviceDriver, Halting

STOPS = 5  # the safe command goes out this often: one may be lost
# Between them, and after the last: publishers keep one message, and the process may end right after.
STOP_PERIOD_S = 0.02
HANGS_S = 0.5  # a write that takes longer than this will not come back


class DriverBackend:
    """Drives one robot by its driver."""

    def __init__(self, robot: Robot, driver: DeviceDriver) -> None:
        self.robot, self._driver = robot, driver
        self._answering = driver if isinstance(driver, Answering) else None
        self._sent = robot.actuators.safe_command
        self._writing = threading.Lock()
        self._closed = False

    def reset(self, episode: Episode, *, seed: int, number: int = 0) -> Sample:
        """Take the pose of the episode for where the robot stands, and send the safe command; see `Backend.reset`."""
        start = episode.start
        if not isinstance(start, PlanarState):  # a device that measures odometry moves in the plane
            start = PlanarState.from_rigid(start.to_rigid())
        self._driver.begin(float(start.x), float(start.y), float(start.yaw))
        return self.step(self.robot.actuators.safe_command)

    def step(self, command: np.ndarray, ticks: int = 1, *, begins: int | None = None) -> Sample:
        """Send a command and take the newest measurement; see `Backend.step`."""
        applied = self._write(np.asarray(command, dtype=float))
        refusal = self._answering.refusal() if self._answering is not None else ""
        report = self._driver.read()
        if report is None:
            return Sample({}, None, applied=applied, refusal=refusal)
        return Sample(report.readings, None, stamp_ns=report.stamp_ns, applied=applied, refusal=refusal)

    def make_safe(self) -> None:
        """Slow wheels down, then send the safe command several times, with time for each to arrive.

        Raises:
            Exception: None of them could be sent; raised by the last one.
        """
        safe = self.robot.actuators.safe_command
        for command in slowdown(self.robot.actuators.refuge, self._sent, safe, STOP_PERIOD_S):
            if self._failure(command) is not None:
                break
            time.sleep(STOP_PERIOD_S)
        stopped, failure = False, None
        for _ in range(STOPS):
            failure = self._failure(safe)
            stopped = stopped or failure is None
            time.sleep(STOP_PERIOD_S)
        if failure is not None and not stopped:
            raise failure

    def close(self) -> None:
        """Stop, and release the device; a device that is gone stops by its own timeout."""
        if self._closed:
            return
        self._closed = True
        try:
            self.make_safe()
        except OSError:
            pass
        finally:
            self._driver.close()

    def health(self) -> dict[str, str]:
        """See `DeviceDriver`."""
        return self._driver.health()

    def _failure(self, command: np.ndarray) -> Exception | None:
        """Send a command; returns what that raised, so that another attempt can follow.

        Raises:
            DeviceError: The driver hangs, and no attempt can follow.
        """
        try:
            self._write(command)
        except _HangsError:
            raise
        except Exception as error:  # noqa: BLE001 - a link that fails once may take the next command
            return error
        return None

    def _write(self, command: np.ndarray) -> np.ndarray:
        if not self._writing.acquire(timeout=HANGS_S):
            raise _HangsError("the driver has not finished a write: it hangs. Stop the device by hand.")
        try:
            applied = self._driver.write(command)
        finally:
            self._writing.release()
        self._sent = command if applied is None else applied
        return self._sent


class FloatingDriverBackend(DriverBackend):
    """Backend of a driver that switches an air bearing; see `AirBearing`."""

    def __init__(self, robot: Robot, driver: DeviceDriver, bearing: AirBearing) -> None:
        super().__init__(robot, driver)
        self._bearing = bearing

    @property
    def bearing_on(self) -> bool:
        """See `AirBearing`."""
        return self._bearing.bearing_on

    def set_bearing(self, on: bool) -> str:
        """See `AirBearing`."""
        return self._bearing.set_bearing(on)

    def _write(self, command: np.ndarray) -> np.ndarray:
        """Send a command, or the safe one while the bearing is off: on the floor, open valves only waste air."""
        return super()._write(command if self.bearing_on else self.robot.actuators.safe_command)


class HaltingDriverBackend(DriverBackend):
    """Backend of a driver that can stop its device as a whole; see `Halting`."""

    def __init__(self, robot: Robot, driver: DeviceDriver, halting: Halting) -> None:
        super().__init__(robot, driver)
        self._halting = halting

    def make_safe(self) -> None:
        """Stop the device before the safe command reaches it; raises as in `DriverBackend`."""
        try:
            self._halting.halt()
        finally:
            super().make_safe()


class EndTakingDriverBackend(DriverBackend):
    """Backend of a driver whose device goes on by itself where commands end; see `TakesEnds`."""

    def __init__(self, robot: Robot, driver: DeviceDriver, takes_ends: TakesEnds) -> None:
        super().__init__(robot, driver)
        self._takes_ends = takes_ends

    def take_end(self, end: CommandEnd) -> None:
        """See `TakesEnds`."""
        self._takes_ends.take_end(end)

    def make_safe(self) -> None:
        """Let the driver know that commands end for good before the safe command; raises as in `DriverBackend`."""
        self._takes_ends.take_end(CommandEnd.STOPPED)
        super().make_safe()


class HandFloatedDriverBackend(EndTakingDriverBackend):
    """The same of a platform whose air bearing a person switches: no wire leads to it."""

    bearing_on = True  # who arms the device has switched it on

    def set_bearing(self, on: bool) -> str:
        """Refuse; see `AirBearing`."""
        return f"no wire leads to the air bearing of '{self.robot.name}': switch it by hand"


class _HangsError(DeviceError):
    """A write that does not come back."""


def backend_of(robot: Robot, driver: DeviceDriver) -> DriverBackend:
    """The backend of a driver, with what it has beside its actuators."""
    if isinstance(driver, AirBearing):
        return FloatingDriverBackend(robot, driver, driver)
    if isinstance(driver, TakesEnds):
        made = HandFloatedDriverBackend if robot.air_bearing else EndTakingDriverBackend
        return made(robot, driver, driver)
    if isinstance(driver, Halting):
        return HaltingDriverBackend(robot, driver, driver)
    return DriverBackend(robot, driver)
