"""Packets of hosts that are no static peer are dropped before the middleware reads them."""

from __future__ import annotations

import socket
import time

import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_ros.peer_filter import PeerFilter, addresses_of, attach, program

DOMAIN = 100  # used by no test, since tests reserve theirs at random: the ports below are bound here alone


def answers(receiver: socket.socket, sender: socket.socket) -> bool:
    """Whether a datagram arrives."""
    receiver.settimeout(0.2)
    sender.sendto(b"x", ("127.0.0.1", receiver.getsockname()[1]))
    try:
        return receiver.recv(8) == b"x"
    except TimeoutError:
        return False


@pytest.fixture
def pair():
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender,
    ):
        receiver.bind(("127.0.0.1", 0))
        yield receiver, sender


def test_a_program_passes_loopback_and_its_addresses(pair):
    attach(pair[0], program(["10.0.0.2", "10.0.0.3"]))
    assert answers(*pair)
    nobody = program([]).replace((0x7F000000).to_bytes(4, "little"), (0x01000000).to_bytes(4, "little"))
    attach(pair[0], nobody)
    assert not answers(*pair)
    strangers = program(["127.0.0.1"]).replace(
        (0x7F000000).to_bytes(4, "little"), (0x01000000).to_bytes(4, "little")
    )
    attach(pair[0], strangers)
    assert answers(*pair)


def test_sockets_of_the_domain_get_the_filter_and_others_none(monkeypatch):
    nobody = program([]).replace((0x7F000000).to_bytes(4, "little"), (0x01000000).to_bytes(4, "little"))
    monkeypatch.setattr("fulmar_ros.peer_filter.program", lambda _addresses: nobody)
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ours,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender,
    ):
        ours.bind(("127.0.0.1", 7400 + 250 * DOMAIN + 248))
        other.bind(("127.0.0.1", 0))
        PeerFilter(["10.0.0.2"], DOMAIN)
        end = time.monotonic() + 5.0
        while answers(ours, sender) and time.monotonic() < end:
            pass
        assert not answers(ours, sender)
        assert answers(other, sender)


def test_a_peer_without_an_address_is_refused_by_name():
    assert addresses_of(["10.1.2.3"]) == {"10.1.2.3"}
    with pytest.raises(ConfigError, match=r"ROS_STATIC_PEERS: 'no\.such\.host\.invalid' cannot be resolved"):
        addresses_of(["no.such.host.invalid"])
