"""Interface of emulated devices, and their end of the wire: a pseudo-terminal or a TCP server for one host."""

from __future__ import annotations

import contextlib
import os
import pty
import socket
import tty
from pathlib import Path
from typing import Protocol

import numpy as np

from fulmar_core.simulation.backend import Sample


class EmulatedDevice(Protocol):
    """A device at the other end of a driver's wire.

    Attributes:
        address: Where the driver finds it.
    """

    address: str

    def command(self, now_s: float) -> np.ndarray:
        """Read the input, and return what the device does now, its own timeout included.

        Args:
            now_s: Monotonic clock [s].

        Returns:
            In the units of the robot's commands, shape (n,).
        """
        ...

    def report(self, sample: Sample, now_s: float) -> None:
        """Send what the device measures, as often as it does."""
        ...

    def close(self) -> None:
        """Close the wire."""
        ...


CHUNK = 4096


class Link(Protocol):
    """Bytes to and from a host, which may be absent.

    Attributes:
        address: Where the host finds it.
    """

    address: str

    def read(self) -> bytes:
        """Bytes since the last call; never waits."""
        ...

    def write(self, data: bytes) -> None:
        """Send; without a host the bytes are lost, as on a cable."""
        ...

    def close(self) -> None:
        """Close it."""
        ...


class PtyLink:
    """A serial port: its far end is a terminal device with a name."""

    def __init__(self, path: Path) -> None:
        """Make it, and a symbolic link to it at `path`."""
        self._end, slave = pty.openpty()
        tty.setraw(slave)
        os.set_blocking(self._end, False)
        self._slave = slave  # kept open, so that no hang-up comes between two hosts
        path.unlink(missing_ok=True)
        path.symlink_to(os.ttyname(slave))
        self._path, self.address = path, str(path)

    def read(self) -> bytes:
        """See `Link`."""
        try:
            return os.read(self._end, CHUNK)
        except OSError:
            return b""

    def write(self, data: bytes) -> None:
        """See `Link`."""
        with contextlib.suppress(OSError):  # full: no host reads
            os.write(self._end, data)

    def close(self) -> None:
        """See `Link`."""
        self._path.unlink(missing_ok=True)
        os.close(self._end)
        os.close(self._slave)


class TcpLink:
    """A TCP server on this host; the newest connection counts."""

    def __init__(self, port: int) -> None:
        """Listen; 0 takes any free port."""
        self._server = socket.create_server(("127.0.0.1", port))
        self._server.setblocking(False)
        self._client: socket.socket | None = None
        self.address = f"tcp://127.0.0.1:{self._server.getsockname()[1]}"

    def read(self) -> bytes:
        """See `Link`."""
        with contextlib.suppress(BlockingIOError):
            client, _ = self._server.accept()
            self._drop()
            client.setblocking(False)
            client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._client = client
        if self._client is None:
            return b""
        try:
            data = self._client.recv(CHUNK)
        except BlockingIOError:
            return b""
        except OSError:
            data = b""
        if not data:
            self._drop()
        return data

    def write(self, data: bytes) -> None:
        """See `Link`."""
        if self._client is not None:
            try:
                self._client.sendall(data)
            except OSError:
                self._drop()

    def close(self) -> None:
        """See `Link`."""
        self._drop()
        self._server.close()

    def _drop(self) -> None:
        if self._client is not None:
            self._client.close()
            self._client = None
