"""Addresses of autopilots, as hardware files name them."""

from __future__ import annotations

import ipaddress
from dataclasses import dataclass

KINDS = {"udpin": "udpin", "udp": "udpin", "udpout": "udpout", "tcp": "tcp"}  # by what an address begins with


@dataclass(frozen=True)
class Place:
    """Where an autopilot is reached."""

    kind: str  # udpin, udpout, tcp or serial
    host: str  # path of a serial port
    number: int  # port; baud rate of a serial one, 0: as in the settings

    @property
    def is_open(self) -> bool:
        """Whether other hosts can send to it without having been asked."""
        return self.kind == "udpin" and not is_loopback(self.host)


def place_of(port: str) -> Place:
    """Read the address of an autopilot.

    Args:
        port: `udpin:host:port` listens there, `udpout:host:port` and `tcp:host:port` call there; else the path of a
            serial port, as /dev/ttyACM0, with a baud rate behind a comma or without.

    Raises:
        ValueError: It is none of these.
    """
    scheme, colon, rest = port.partition(":")
    if not colon or scheme.startswith("/"):
        path, _, baud = port.partition(",")
        return Place("serial", path, int(baud) if baud.isdecimal() else 0)
    host, _, number = rest.removeprefix("//").rpartition(":")
    if scheme not in KINDS or not host or not number.isdecimal() or not 0 < int(number) < 65536:
        raise ValueError(
            f"port = '{port}' must be udpin:host:port, udpout:host:port, tcp:host:port or a serial port such as "
            "/dev/ttyACM0."
        )
    return Place(KINDS[scheme], host, int(number))


def is_loopback(host: str) -> bool:
    """Whether an address is reached from this computer alone."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"
