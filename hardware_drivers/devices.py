"""Driver of a hardware file, importing only its library, and what stops the device if the driver dies."""

from __future__ import annotations

from dataclasses import dataclass, replace

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot import Robot
from hardware_drivers.driver_backend import DriverBackend, backend_of
from hardware_drivers.hardware import Hardware
from hardware_drivers.settings import (
    Driver,
    GpioValves,
    KingfisherNmea,
    Kobuki,
    MavlinkBoat,
    OwnDriver,
    ThrustTopic,
    ValveTopic,
    VelocityTopic,
    XPlane,
)


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
    if isinstance(settings, (GpioValves, Kobuki, KingfisherNmea, MavlinkBoat, XPlane, OwnDriver)) and port:
        settings = replace(settings, port=port)
    if isinstance(settings, GpioValves):
        from hardware_drivers.thruster_driver import ThrusterDriver, ValveDriver

        kind = ValveDriver if settings.bearing is None else ThrusterDriver
        return backend_of(robot, kind(robot, settings, patience_s=patience_s))
    if isinstance(settings, Kobuki):
        from hardware_drivers.kobuki_driver import KobukiDriver

        return backend_of(robot, KobukiDriver(robot, settings, patience_s=patience_s))
    if isinstance(settings, KingfisherNmea):
        from hardware_drivers.kingfisher_driver import KingfisherDriver

        return backend_of(robot, KingfisherDriver(robot, settings, patience_s=patience_s))
    if isinstance(settings, MavlinkBoat):
        from hardware_drivers.mavlink_driver import MavlinkDriver

        return backend_of(robot, MavlinkDriver(robot, settings, patience_s=patience_s))
    if isinstance(settings, XPlane):
        from hardware_drivers.xplane_driver import XPlaneDriver

        return backend_of(robot, XPlaneDriver(robot, settings, patience_s=patience_s))
    if isinstance(settings, OwnDriver):
        from hardware_drivers.own_driver import make_own_driver

        return make_own_driver(robot, settings, patience_s=patience_s)
    raise ConfigError(f"driver '{settings.kind}' publishes messages; it has no port of its own.")


UNPROTECTED = "NOTHING BELOW THE DRIVER STOPS THE"  # how the warning begins, also in hardware files


@dataclass(frozen=True)
class OwnWatchdog:
    """A watchdog below the driver."""

    by: str  # whose it is
    within_s: float  # after the last command or heartbeat [s]


WATCHDOGS: dict[type, OwnWatchdog] = {
    Kobuki: OwnWatchdog("the firmware of the base, without base control", 0.6),
    KingfisherNmea: OwnWatchdog("the front seat of the boat, without $PYDIR", 0.5),
    MavlinkBoat: OwnWatchdog("ArduPilot, without heartbeats: FS_GCS_ENABLE 1, FS_TIMEOUT", 1.5),
    VelocityTopic: OwnWatchdog("kobuki_node, without a velocity; another node may have no timeout", 0.6),
}
# The chip's pins and the lab's node keep the valves as they are; RoboRAN's bridge to /action is not public.
MOVES_ON: dict[type, str] = {
    GpioValves: "VALVES",
    ValveTopic: "VALVES",
    ThrustTopic: "PROPELLERS",
    XPlane: "AIRCRAFT",
    OwnDriver: "ACTUATORS",
}
SUPPLY = "build in a supply that closes without the driver (docs/hardware.md)"
INSTEAD: dict[type, str] = {XPlane: "X-Plane flies on with the last commands; its key P pauses it"}


def own_watchdog(driver: Driver) -> OwnWatchdog | None:
    """The watchdog that stops the device when the driver dies; None if none is known."""
    if isinstance(driver, OwnDriver) and driver.device_timeout_s:
        return OwnWatchdog("the device, says its hardware file", driver.device_timeout_s)
    return WATCHDOGS.get(type(driver))


def when_the_driver_dies(driver: Driver) -> str:
    """One sentence for the user, in capitals where nothing stops the device."""
    watchdog = own_watchdog(driver)
    if watchdog is not None:
        return f"if the driver dies, stopped within {watchdog.within_s:g} s by {watchdog.by}"
    instead = INSTEAD.get(type(driver), SUPPLY)
    return f"{UNPROTECTED} {MOVES_ON[type(driver)]} WHEN IT DIES: {instead}"
