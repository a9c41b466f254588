"""From a hardware file to the driver that it asks for; only that one's library is imported."""

from __future__ import annotations

from dataclasses import replace

from fulmar_core.backend import Device
from fulmar_core.errors import ConfigError
from fulmar_core.robot import Robot
from hardware_drivers.settings import GpioValves, Hardware, KingfisherNmea, Kobuki, MavlinkBoat


def make_device(robot: Robot, hardware: Hardware, *, port: str, patience_s: float) -> Device:
    """Build a driver that talks to a device itself.

    Args:
        robot: The robot.
        hardware: What is wired to it.
        port: Takes the place of the file's port; empty: the file's.
        patience_s: Wait so long for the device [s].

    Raises:
        ConfigError: The file names another robot, or a driver that needs ROS.
        DeviceError: The device is not there.
    """
    settings = hardware.driver
    if hardware.robot != robot.name:
        raise ConfigError(f"the hardware file is of '{hardware.robot}', the robot is '{robot.name}'.")
    if isinstance(settings, (GpioValves, Kobuki, KingfisherNmea, MavlinkBoat)) and port:
        settings = replace(settings, port=port)
    if isinstance(settings, GpioValves):
        from hardware_drivers.thruster_driver import ThrusterDriver

        return ThrusterDriver(robot, settings, patience_s=patience_s)
    if isinstance(settings, Kobuki):
        from hardware_drivers.kobuki_driver import KobukiDriver

        return KobukiDriver(robot, settings, patience_s=patience_s)
    if isinstance(settings, KingfisherNmea):
        from hardware_drivers.kingfisher_driver import KingfisherDriver

        return KingfisherDriver(robot, settings, patience_s=patience_s)
    if isinstance(settings, MavlinkBoat):
        from hardware_drivers.mavlink_driver import MavlinkDriver

        return MavlinkDriver(robot, settings, patience_s=patience_s)
    raise ConfigError(f"driver '{settings.kind}' publishes messages; it has no port of its own.")
