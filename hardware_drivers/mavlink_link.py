"""A MAVLink link to one autopilot: the first that speaks, locked by address, system and component."""

from __future__ import annotations

import threading
import time
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from fulmar_core.config.errors import DeviceError
from hardware_drivers.mavlink_address import place_of
from hardware_drivers.mavlink_signing import GOOD, OLD, Signatures, ticks_now
from hardware_drivers.ports import Port, SerialPort, TcpPort, UdpListener, UdpPort, patiently

Address = tuple[int, int]  # system and component
HOST_SYSTEM, HOST_COMPONENT = 255, 190  # a ground station, which is whose overrides ArduPilot takes
LONGEST_BACKLOG = 1 << 16  # bytes of a stream that the decoder may keep


class MavlinkLink:
    """Sends to one autopilot, and receives what it says; what others say is counted and dropped.

    One thread receives; any thread sends.

    Attributes:
        autopilot: System and component of the first autopilot that sent a heartbeat; None before. Gimbals and ground
            stations send some, too.
        refused: Messages of others, and without a signature where there must be one.
        refusal: Why the last of them was.
    """

    def __init__(self, port: Port, key: bytes = b"") -> None:
        """Use an open port; `key` signs what is sent, and must have signed what is received."""
        self._port, self._locked, self._sending = port, threading.Event(), threading.Lock()
        self.autopilot: Address | None = None
        self.refused, self.refusal = 0, ""
        self._signatures = Signatures(key) if key else None
        self._encoder = mavlink.MAVLink(None, srcSystem=HOST_SYSTEM, srcComponent=HOST_COMPONENT)
        if key:
            self._encoder.signing.secret_key, self._encoder.signing.sign_outgoing = key, True
        self._decoder = _decoder()

    def wait(self, timeout_s: float) -> None:
        """Wait for the autopilot, while another thread receives; returns without it when the time is over."""
        self._locked.wait(timeout_s)

    def receive(self) -> list[Any]:
        """Messages of the autopilot that came now, or within a short wait; raises OSError when the link is gone."""
        data = self._port.read()
        if not data:
            return []
        listens = isinstance(self._port, UdpListener)
        if listens or isinstance(
            self._port, UdpPort
        ):  # a datagram holds whole messages: no part of one is kept
            self._decoder = _decoder()
        elif self._decoder.buf_index > LONGEST_BACKLOG:
            del self._decoder.buf[: self._decoder.buf_index]
            self._decoder.buf_index = 0
        return [message for message in self._decoder.parse_buffer(data) or [] if self._is_of_it(message)]

    def send(self, message: Any) -> None:
        """Send a message at once; one to nobody is dropped. Raises OSError."""
        with self._sending:
            self._port.write(self._packed(message))

    def close(self) -> None:
        """Close the port."""
        self._port.close()

    def _is_of_it(self, message: Any) -> bool:
        """Whether a message is the autopilot's; the first heartbeat of one decides who that is."""
        kind = message.get_type()
        if kind == "BAD_DATA" or kind.startswith("UNKNOWN"):
            return False
        sender = message.get_srcSystem(), message.get_srcComponent()
        if self.autopilot is not None and sender != self.autopilot:
            return self._refuse(f"it is of system {sender[0]}, component {sender[1]}")
        problem = self._signatures.problem(bytes(message.get_msgbuf())) if self._signatures else GOOD
        if problem:
            if problem == OLD and self.autopilot is None:
                self._tell_the_time()
            return self._refuse(problem)
        if self.autopilot is None:
            if kind != "HEARTBEAT" or message.autopilot == mavlink.MAV_AUTOPILOT_INVALID:
                return False
            if isinstance(self._port, UdpListener):
                self._port.accept()
            self.autopilot = sender
            self._locked.set()
        return True

    def _refuse(self, reason: str) -> bool:
        self.refused, self.refusal = self.refused + 1, reason
        return False

    def _tell_the_time(self) -> None:
        """Send a heartbeat to an autopilot with the key whose clock is behind: it goes on from our time."""
        with self._sending:
            packet = self._packed(heartbeat())
            if isinstance(self._port, UdpListener):
                self._port.answer(packet)
            else:
                self._port.write(packet)

    def _packed(self, message: Any) -> bytes:
        encoder = self._encoder
        if self._signatures is not None:
            encoder.signing.timestamp = max(
                encoder.signing.timestamp, ticks_now(), self._signatures.newest + 1
            )
        packet = bytes(message.pack(encoder))
        encoder.seq = (encoder.seq + 1) % 256
        return packet


def open_link(port: str, baud: int, key: bytes, patience_s: float) -> MavlinkLink:
    """Open a link as soon as it can be opened.

    Args:
        port: As in `place_of`.
        baud: Of a serial port.
        key: As in `MavlinkLink`.
        patience_s: Try again for so long [s].

    Raises:
        DeviceError: It cannot be opened.
    """
    place = place_of(port)

    def make() -> Port:
        if place.kind == "serial":
            return SerialPort(place.host, place.number or baud)
        kinds: dict[str, type[UdpListener] | type[UdpPort] | type[TcpPort]]
        kinds = {"udpin": UdpListener, "udpout": UdpPort, "tcp": TcpPort}
        return kinds[place.kind](place.host, place.number)

    return MavlinkLink(patiently(make, port, patience_s), key)


def wait_for_autopilot(link: MavlinkLink, port: str, patience_s: float) -> Address:
    """Address of the autopilot, while another thread receives.

    Raises:
        DeviceError: None spoke in time.
    """
    until = time.monotonic() + patience_s
    while link.autopilot is None and time.monotonic() < until:
        link.wait(max(0.0, until - time.monotonic()))
    if link.autopilot is None:
        refused = f"; {link.refused} messages refused, the last: {link.refusal}" if link.refused else ""
        raise DeviceError(f"autopilot at {port}: no heartbeat for {patience_s:g} s{refused}. Is it on?")
    return link.autopilot


def heartbeat() -> Any:
    """The host's own heartbeat."""
    return mavlink.MAVLink_heartbeat_message(
        mavlink.MAV_TYPE_ONBOARD_CONTROLLER, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, 0, 3
    )


def _decoder() -> Any:
    made = mavlink.MAVLink(None)
    made.robust_parsing = True
    return made
