"""Byte streams to devices: serial ports, TCP and UDP, read in a thread of their own, written without waiting."""

from __future__ import annotations

import contextlib
import os
import socket
import threading
import time
from collections.abc import Callable
from typing import Protocol, TypeVar

import serial

from fulmar_core.config.errors import ConfigError, DeviceError

T = TypeVar("T")
READ_S = 0.05  # longest wait of the reading thread, and so of `stop`
RETRY_S = 0.1
CHUNK = 4096


class Port(Protocol):
    """A stream of bytes in both directions."""

    def read(self) -> bytes:
        """Read bytes; none after a short timeout. Raises OSError when the other side is gone."""
        ...

    def write(self, data: bytes) -> None:
        """Send; raises OSError when that would block."""
        ...

    def close(self) -> None:
        """Close."""
        ...


class SerialPort:
    """A serial port."""

    def __init__(self, path: str, baud: int) -> None:
        """Open it; raises OSError."""
        self._port = serial.Serial(path, baud, timeout=READ_S, exclusive=True)

    def read(self) -> bytes:
        """See `Port`."""
        return bytes(self._port.read(max(1, self._port.in_waiting)))

    def write(self, data: bytes) -> None:
        """See `Port`."""
        write_at_once(self._port.fileno(), data)

    def close(self) -> None:
        """See `Port`."""
        self._port.close()


class TcpPort:
    """A TCP connection to a device."""

    def __init__(self, host: str, port: int) -> None:
        """Connect; raises OSError."""
        self._socket = socket.create_connection((host, port), timeout=2.0)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._socket.settimeout(READ_S)

    def read(self) -> bytes:
        """See `Port`."""
        try:
            data = self._socket.recv(CHUNK)
        except TimeoutError:
            return b""
        if not data:
            raise OSError("the other side closed the connection")
        return data

    def write(self, data: bytes) -> None:
        """See `Port`."""
        write_at_once(self._socket.fileno(), data)

    def close(self) -> None:
        """See `Port`."""
        self._socket.close()


class UdpPort:
    """A UDP link to a device: each write is one datagram, and datagrams of the device alone are read."""

    def __init__(self, host: str, port: int) -> None:
        """Choose the device; raises OSError for an unknown host."""
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.settimeout(READ_S)
        try:
            self._socket.connect((host, port))
        except OSError:
            self._socket.close()
            raise

    def read(self) -> bytes:
        """See `Port`."""
        try:
            return self._socket.recv(CHUNK)
        except (TimeoutError, ConnectionRefusedError):  # a device that is switched on late refuses until then
            return b""

    def write(self, data: bytes) -> None:
        """See `Port`."""
        with contextlib.suppress(ConnectionRefusedError):
            write_at_once(self._socket.fileno(), data)

    def close(self) -> None:
        """See `Port`."""
        self._socket.close()


class UdpListener:
    """A UDP port at which a device calls: anyone's datagrams are read until `accept`, and its own alone after it."""

    def __init__(self, host: str, port: int) -> None:
        """Listen at an address of this computer; raises OSError."""
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.settimeout(READ_S)
        self._caller: tuple[str, int] | None = None  # whose datagram was read last
        self._device: tuple[str, int] | None = None
        try:
            self._socket.bind((host, port))
        except OSError:
            self._socket.close()
            raise

    def read(self) -> bytes:
        """See `Port`."""
        try:
            data, self._caller = self._socket.recvfrom(CHUNK)
        except (TimeoutError, ConnectionRefusedError):
            return b""
        # Those that came before `accept` wait in the queue still.
        return data if self._device in (None, self._caller) else b""

    def accept(self) -> None:
        """Take the sender of the last datagram for the device: the kernel drops what others send."""
        assert self._caller is not None  # called with what was read
        self._socket.connect(self._caller)
        self._device = self._caller

    def answer(self, data: bytes) -> None:
        """Send to the sender of the last datagram, before `accept`; raises OSError."""
        if self._caller is not None:
            self._socket.sendto(data, self._caller)

    def write(self, data: bytes) -> None:
        """See `Port`; dropped before `accept`."""
        if self._device is not None:
            with contextlib.suppress(ConnectionRefusedError):
                write_at_once(self._socket.fileno(), data)

    def close(self) -> None:
        """See `Port`."""
        self._socket.close()


def open_port(address: str, baud: int, patience_s: float) -> Port:
    """Open a device's port, and wait for it if it is not there yet.

    Args:
        address: Path of a serial port, `tcp://host:port` or `udp://host:port`.
        baud: Of a serial port.
        patience_s: Try again for so long [s].

    Raises:
        ConfigError: The address is malformed.
        DeviceError: It cannot be opened.
    """
    return patiently(_maker(address, baud), address, patience_s)


def patiently(make: Callable[[], T], address: str, patience_s: float) -> T:
    """Open a connection, and retry while its other end is missing.

    Args:
        make: Opens it; raises OSError.
        address: For messages.
        patience_s: Try again for so long [s].

    Raises:
        DeviceError: It cannot be opened.
    """
    until = time.monotonic() + patience_s
    while True:
        try:
            return make()
        except OSError as error:
            if time.monotonic() > until:
                reason = error.strerror or str(error)
                raise DeviceError(
                    f"{address} cannot be opened: {reason}. Is the device connected, and may this user use the port?"
                ) from error
        time.sleep(RETRY_S)


def write_at_once(descriptor: int, data: bytes) -> None:
    """Send through a descriptor that never blocks; raises OSError when it does not take all of the bytes at once.

    pyserial's own write waits, or takes a late thread for a late device.
    """
    if os.write(descriptor, data) < len(data):
        raise OSError("it does not take any more bytes")


def _maker(address: str, baud: int) -> Callable[[], Port]:
    scheme, _, place = address.partition("://")
    if scheme not in SCHEMES:
        return lambda: SerialPort(address, baud)
    host, _, number = place.rpartition(":")
    if not host or not number.isdecimal() or not 0 < int(number) < 65536:
        raise ConfigError(
            f"port = '{address}' must be a serial port such as /dev/ttyUSB0, tcp://host:port or udp://host:port."
        )
    return lambda: SCHEMES[scheme](host, int(number))


SCHEMES: dict[str, type[TcpPort] | type[UdpPort]] = {"tcp": TcpPort, "udp": UdpPort}


class Reader:
    """Thread that passes the bytes of a port to a function."""

    def __init__(self, port: Port, take: Callable[[bytes], None], on_end: Callable[[str], None]) -> None:
        """Start.

        Args:
            port: Where to read.
            take: Receives the bytes; an exception in it ends the reading, as a lost port does.
            on_end: Receives the reason once reading has ended; not called at `stop`.
        """
        self._port, self._take, self._on_end = port, take, on_end
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run, name="device reader", daemon=True)
        self._thread.start()

    def _run(self) -> None:
        while not self._over.is_set():
            try:
                data = self._port.read()
            except (
                OSError,
                TypeError,
                AttributeError,
            ) as error:  # pyserial's own ways to say that it was closed
                if not self._over.is_set():
                    self._on_end(f"the connection is gone ({error})")
                return
            try:
                if data:
                    self._take(data)
            except Exception as error:  # noqa: BLE001 - a thread that died in silence would look like a silent device
                self._on_end(f"what it said cannot be read ({type(error).__name__}: {error})")
                return

    def stop(self) -> None:
        """End the thread, then close the port."""
        self._over.set()
        self._thread.join(4 * READ_S)
        with contextlib.suppress(OSError):
            self._port.close()
