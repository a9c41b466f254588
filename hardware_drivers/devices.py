"""From a hardware file to the driver that it asks for; only that one's library is imported."""

from __future__ import annotations

from dataclasses import replace

from fulmar_core.errors import ConfigError
from fulmar_core.robot import Robot
from hardware_drivers.driver_backend import DriverBackend, backend_of
from hardware_drivers.settings import GpioValves, Hardware, KingfisherNmea, Kobuki, MavlinkBoat, OwnDriver


def make_device(robot: Robot, hardware: Hardware, *, port: str, patience_s: float) -> DriverBackend:
    """Build a driver that talks to a device itself.

    Args:
        robot: The robot.
        hardware: What is wired to it.
        port: Takes the place of the file's port; empty: the file's.
        patience_s: Wait so long for the device [s].

    Raises:
        ConfigError: The file names another robot, a driver that needs ROS, or an own class that cannot be used.
        DeviceError: The device is not there.
    """
    settings = hardware.driver
    if hardware.robot != robot.name:
        raise ConfigError(f"the hardware file is of '{hardware.robot}', the robot is '{robot.name}'.")
    if isinstance(settings, (GpioValves, Kobuki, KingfisherNmea, MavlinkBoat, OwnDriver)) and port:
        settings = replace(settings, port=port)
    if isinstance(settings, GpioValves):
        from hardware_drivers.thruster_driver import ThrusterDriver

        return backend_of(robot, ThrusterDriver(robot, settings, patience_s=patience_s))
    if isinstance(settings, Kobuki):
        from hardware_drivers.kobuki_driver import KobukiDriver

        return backend_of(robot, KobukiDriver(robot, settings, patience_s=patience_s))
    if isinstance(settings, KingfisherNmea):
        from hardware_drivers.kingfisher_driver import KingfisherDriver

        return backend_of(robot, KingfisherDriver(robot, settings, patience_s=patience_s))
    if isinstance(settings, MavlinkBoat):
        from hardware_drivers.mavlink_driver import MavlinkDriver

        return backend_of(robot, MavlinkDriver(robot, settings, patience_s=patience_s))
    if isinstance(settings, OwnDriver):
        from hardware_drivers.own_driver import make_own_driver

        return make_own_driver(robot, settings, patience_s=patience_s)
    raise ConfigError(f"driver '{settings.kind}' publishes messages; it has no port of its own.")
