"""Driver of a hardware file, importing only its library, and what stops the device if the driver dies."""

from __future__ import annotations

from dataclasses import replace
from importlib import import_module

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot import Robot
from hardware_drivers.driver import DeviceDriver
from hardware_drivers.driver_backend import DriverBackend, backend_of
from hardware_drivers.driver_facts import OwnWatchdog
from hardware_drivers.hardware import TOPIC_DRIVERS, Hardware
from hardware_drivers.px4_settings import Px4Thrusters, Px4Wing
from hardware_drivers.settings import Driver, OwnDriver


def make_device(robot: Robot, hardware: Hardware, *, port: str, patience_s: float) -> DriverBackend:
    """Build a driver that talks to a device itself.

    Args:
        robot: The robot.
        hardware: Its hardware file.
        port: Takes the place of the file's port; empty: the file's.
        patience_s: Wait so long for the device [s].

    Raises:
        ConfigError: The file names another robot, a driver that needs ROS, or an own class that cannot be used.
        DeviceError: The device is not there.
    """
    settings = hardware.driver
    if hardware.robot != robot.name:
        raise ConfigError(f"the hardware file is of '{hardware.robot}', the robot is '{robot.name}'.")
    if port and not isinstance(settings, TOPIC_DRIVERS) and not isinstance(settings, (Px4Thrusters, Px4Wing)):
        settings = replace(settings, port=port)
    if isinstance(settings, OwnDriver):
        from hardware_drivers.own_driver import make_own_driver

        return make_own_driver(robot, settings, patience_s=patience_s)
    module, _, name = settings.made_by.partition(":")
    if name:
        made: DeviceDriver = getattr(import_module(module), name)(robot, settings, patience_s=patience_s)
        return backend_of(robot, made)
    raise ConfigError(f"driver '{settings.kind}' publishes messages; it has no port of its own.")


UNPROTECTED = "NOTHING BELOW THE DRIVER STOPS THE"  # how the warning begins, also in hardware files


SUPPLY = "build in a supply that closes without the driver (docs/hardware.md)"


def own_watchdog(driver: Driver) -> OwnWatchdog | None:
    """The watchdog that stops the device when the driver dies; None if none is known."""
    return driver.stopped_by


def when_the_driver_dies(driver: Driver) -> str:
    """One sentence for the user, in capitals where nothing stops the device."""
    watchdog = own_watchdog(driver)
    if watchdog is not None:
        return f"if the driver dies, stopped within {watchdog.within_s:g} s by {watchdog.by}"
    return f"{UNPROTECTED} {driver.moves_on} WHEN IT DIES: {driver.instead or SUPPLY}"
