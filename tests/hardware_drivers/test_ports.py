"""The thread that reads from a device reports its end."""

from __future__ import annotations

import socket
from collections.abc import Callable, Iterator

import pytest

from fulmar_core.config.errors import DeviceError
from hardware_drivers.ports import Reader, TcpPort, open_port
from tests.hardware_drivers.bench import until

Read = Callable[[Callable[[bytes], None]], tuple[socket.socket, list[str]]]


@pytest.fixture
def reading() -> Iterator[Read]:
    """Starts a reader at the end of a TCP connection; gives the device's end, and what the reader said at its own."""
    made: list[Reader] = []
    with socket.create_server(("127.0.0.1", 0)) as server:

        def begin(take: Callable[[bytes], None]) -> tuple[socket.socket, list[str]]:
            ends: list[str] = []
            port = TcpPort("127.0.0.1", server.getsockname()[1])
            device, _ = server.accept()
            made.append(Reader(port, take, ends.append))
            return device, ends

        yield begin
        for reader in made:
            reader.stop()


def test_bytes_are_handed_on(reading):
    received = []
    device, ends = reading(received.append)
    device.sendall(b"hello")
    until(lambda: b"".join(received) == b"hello")
    assert not ends


def test_a_closed_connection_is_reported_once(reading):
    device, ends = reading(lambda _data: None)
    device.close()
    until(lambda: bool(ends))
    assert ends == ["the connection is gone (the other side closed the connection)"]


def test_an_exception_of_the_receiver_is_reported(reading):
    def take(_data: bytes) -> None:
        raise ZeroDivisionError("by a decoder")

    device, ends = reading(take)
    device.sendall(b"x")
    until(lambda: bool(ends))
    assert ends == ["what it said cannot be read (ZeroDivisionError: by a decoder)"]


def test_a_udp_device_is_written_to_and_read_from_and_may_be_late():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as device:
        device.bind(("127.0.0.1", 0))
        port = open_port(f"udp://127.0.0.1:{device.getsockname()[1]}", 0, 0.0)
        port.write(b"on")
        data, driver = device.recvfrom(16)
        assert data == b"on"
        device.sendto(b"done", driver)
        assert port.read() == b"done"
    for _ in range(3):  # its own end refuses now, as a device that is off does
        port.write(b"off")
        assert port.read() == b""
    port.close()


def test_a_host_that_is_unknown_is_refused():
    with pytest.raises(DeviceError, match="cannot be opened"):
        open_port("udp://no.such.host.invalid:5", 0, 0.0)
