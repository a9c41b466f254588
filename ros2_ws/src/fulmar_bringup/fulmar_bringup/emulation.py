"""The emulator of a hardware file's device, and the wire between driver and emulator."""

from __future__ import annotations

import socket
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from fulmar_core.config.errors import ConfigError
from hardware_drivers.hardware import Hardware
from hardware_drivers.plane_settings import MavlinkPlane
from hardware_drivers.presence import check_messages
from hardware_drivers.px4_settings import BY_MAVLINK, Px4Thrusters, Px4Wing
from hardware_drivers.settings import (
    Driver,
    GpioValves,
    KingfisherNmea,
    Kobuki,
    MavlinkBoat,
    OwnDriver,
    PwmValves,
    ThrustTopic,
    ValveTopic,
    VelocityTopic,
    XPlane,
)

Parameters = Mapping[str, bool | str | list[int] | list[str]]


@dataclass(frozen=True)
class Emulation:
    """Both ends of an emulated wire."""

    device: str  # of `sim_nodes.emulator_node`
    link: str  # what the emulator makes
    port: str  # where the driver finds it
    more: Parameters = field(default_factory=dict)  # parameters of the emulator


def check_emulated(driver: Driver) -> None:
    """Raise ConfigError for a device without an emulator, such as of a user's own driver, and for a boat that signs.

    The messages of a driver must be installed, too.
    """
    check_messages(driver)
    if isinstance(driver, (MavlinkBoat, MavlinkPlane)) and driver.signing_key:
        raise ConfigError(
            "the emulated autopilot has no key: leave 'signing_key' out of the hardware file, or --emulate."
        )
    if not driver.emulator:
        whose = "your own driver" if isinstance(driver, OwnDriver) else "driver"
        raise ConfigError(
            f"no emulator exists for the device of {whose} '{driver.kind}'. Leave --emulate out, and let "
            "`port:` of the hardware file name an emulator of your own, such as a pseudo-terminal."
        )


def emulation_of(hardware: Hardware, folder: Path) -> Emulation:
    """The emulated device of a hardware file; wires that are files are made in `folder`.

    Raises:
        ConfigError: There is none for it.
    """
    driver = hardware.driver
    check_emulated(driver)
    if isinstance(driver, ValveTopic):
        takes: Parameters = {"order": list(driver.order), "message": driver.message}
        return Emulation(driver.emulator, driver.topic, "", takes)
    if isinstance(driver, VelocityTopic):
        sides: Parameters = {"stamped": driver.stamped, "sides": list(driver.wiring)}
        return Emulation(driver.emulator, driver.topic, "", sides)
    if isinstance(driver, ThrustTopic):
        return Emulation(driver.emulator, driver.topic, "", {"sides": list(driver.wiring)})
    if isinstance(driver, GpioValves):
        pins = folder / "gpio"
        more: Parameters = {
            "order": list(driver.order),
            "active_low": driver.active_low,
            "bearing": driver.bearing is not None,
            "supply": driver.supply is not None,
        }
        return Emulation(driver.emulator, str(pins), f"file://{pins}", more)
    if isinstance(driver, PwmValves):
        chip = str(folder / "pwmchip")
        return Emulation(
            driver.emulator, chip, chip, {"order": list(driver.order), "channels": list(driver.channels)}
        )
    if isinstance(driver, XPlane):
        number = _free_port(socket.SOCK_DGRAM)
        return Emulation(driver.emulator, f"udp:{number}", f"udp://127.0.0.1:{number}")
    if isinstance(driver, (Px4Thrusters, Px4Wing)):
        return _px4_emulation(driver)
    if isinstance(driver, MavlinkPlane):
        number = _free_port(socket.SOCK_DGRAM)
        return Emulation(driver.emulator, f"udp:{number}", f"udpin:127.0.0.1:{number}")
    assert isinstance(driver, (MavlinkBoat, Kobuki, KingfisherNmea))
    more = {"sides": list(driver.wiring)}
    if isinstance(driver, MavlinkBoat):
        number = _free_port(socket.SOCK_DGRAM)
        return Emulation(driver.emulator, f"udp:{number}", f"udpin:127.0.0.1:{number}", more)
    if isinstance(driver, KingfisherNmea) and driver.port.startswith("tcp://"):
        number = _free_port(socket.SOCK_STREAM)
        return Emulation(driver.emulator, f"tcp:{number}", f"tcp://127.0.0.1:{number}", more)
    return Emulation(driver.emulator, str(folder / "serial"), str(folder / "serial"), more)


def _px4_emulation(driver: Px4Thrusters | Px4Wing) -> Emulation:
    """Its topics are those of the file; the driver's port is that of its parameters, where they go by MAVLink."""
    more: Parameters = {"order": list(driver.order)} if isinstance(driver, Px4Thrusters) else {}
    link = f"topics:{driver.topics}"
    if driver.failsafe.confirm != BY_MAVLINK:
        return Emulation(driver.emulator, link, "", more)
    number = _free_port(socket.SOCK_DGRAM)
    return Emulation(
        driver.emulator, link, f"udpin:127.0.0.1:{number}", {**more, "parameters": f"udp:{number}"}
    )


def _free_port(kind: socket.SocketKind) -> int:
    with socket.socket(socket.AF_INET, kind) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])
