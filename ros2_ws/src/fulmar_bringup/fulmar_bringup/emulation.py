"""Which emulator stands in for a hardware file's device, and how driver and emulator find each other."""

from __future__ import annotations

import socket
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from fulmar_core.errors import ConfigError
from hardware_drivers.settings import GpioValves, Hardware, KingfisherNmea, Kobuki, MavlinkBoat


@dataclass(frozen=True)
class Emulation:
    """Both ends of an emulated wire."""

    device: str  # of `sim_nodes.emulator_node`
    link: str  # what the emulator makes
    port: str  # where the driver finds it
    more: Mapping[str, bool | list[int]] = field(default_factory=dict)  # parameters of the emulator


def check_emulation(hardware: Hardware) -> None:
    """Refuse hardware that nothing stands in for.

    Raises:
        ConfigError: It is a node of another stack.
    """
    if not isinstance(hardware.driver, (GpioValves, Kobuki, KingfisherNmea, MavlinkBoat)):
        raise ConfigError(
            f"there is no emulator for driver '{hardware.driver.kind}', which speaks to a node of another stack. "
            "Leave --emulate out, and start that node."
        )


def emulation_of(hardware: Hardware, folder: Path) -> Emulation:
    """What stands in for a hardware file's device.

    Args:
        hardware: The file.
        folder: Where wires that are files are made.

    Raises:
        ConfigError: Nothing does.
    """
    check_emulation(hardware)
    driver = hardware.driver
    if isinstance(driver, GpioValves):
        pins = folder / "gpio"
        more: dict[str, bool | list[int]] = {"order": list(driver.order), "active_low": driver.active_low}
        return Emulation("valves", str(pins), f"file://{pins}", more)
    if isinstance(driver, MavlinkBoat):
        number = _free_port(socket.SOCK_DGRAM)
        return Emulation("ardupilot", f"udp:{number}", f"udpin:127.0.0.1:{number}")
    device = "kobuki" if isinstance(driver, Kobuki) else "kingfisher"
    if isinstance(driver, KingfisherNmea) and driver.port.startswith("tcp://"):
        number = _free_port(socket.SOCK_STREAM)
        return Emulation(device, f"tcp:{number}", f"tcp://127.0.0.1:{number}")
    return Emulation(device, str(folder / "serial"), str(folder / "serial"))


def _free_port(kind: socket.SocketKind) -> int:
    with socket.socket(socket.AF_INET, kind) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])
