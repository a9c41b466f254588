"""Datagrams of strangers are dropped where ROS_STATIC_PEERS names the hosts that a node talks to.

The middleware listens on every interface then, and asks nobody who he is. A packet filter on its sockets (classic BPF,
which needs no privilege) lets pass what the peers and this host sent, by source address. Who can forge the address of a
peer passes it; against that helps a tunnel, or enclaves.
"""

from __future__ import annotations

import contextlib
import ctypes
import ipaddress
import os
import socket
import struct
import threading
from collections.abc import Iterable
from pathlib import Path

import psutil

from fulmar_core.config.errors import ConfigError
from fulmar_ros.middleware import STATIC_PEERS
from fulmar_ros.rtps_ports import ports_of_domain

SO_ATTACH_FILTER = 26  # asm-generic/socket.h
# linux/bpf_common.h and linux/filter.h: load a word, compare, mask, return.
LOAD, EQUAL, AND, RETURN = 0x20, 0x15, 0x54, 0x06
SOURCE_ADDRESS = 0xFFF00000 + 12  # SKF_NET_OFF, and where an IPv4 header has its source
ALL, NOTHING = 0xFFFFFFFF, 0
FDS = Path("/proc/self/fd")
SOON_S, LATER_S = 0.005, 1.0  # between two looks for sockets, before the first are found and then


def addresses_of(peers: Iterable[str]) -> set[str]:
    """IPv4 addresses of hosts that are given by name or address.

    Raises:
        ConfigError: A name cannot be resolved.
    """
    found = set()
    for peer in peers:
        try:
            found |= set(socket.gethostbyname_ex(peer)[2])
        except OSError as error:
            raise ConfigError(
                f"{STATIC_PEERS}: '{peer}' cannot be resolved ({error}). Give an IPv4 address."
            ) from error
    return found


def program(addresses: Iterable[str]) -> bytes:
    """Instructions that pass packets from loopback and from some addresses, and drop the others."""
    words = [int(ipaddress.IPv4Address(address)) for address in sorted(addresses)]
    count = len(words)
    lines = [
        (LOAD, 0, 0, SOURCE_ADDRESS),
        *((EQUAL, count + 2 - number, 0, word) for number, word in enumerate(words)),
        (AND, 0, 0, 0xFF000000),
        (EQUAL, 1, 0, 0x7F000000),
        (RETURN, 0, 0, NOTHING),
        (RETURN, 0, 0, ALL),
    ]
    return b"".join(struct.pack("HBBI", *line) for line in lines)


def attach(sock: socket.socket, code: bytes) -> None:
    """Put a program between the network and a socket.

    Raises:
        OSError: The kernel refuses it.
    """
    buffer = ctypes.create_string_buffer(code, len(code))
    filtered = struct.pack("HL", len(code) // 8, ctypes.addressof(buffer))
    sock.setsockopt(socket.SOL_SOCKET, SO_ATTACH_FILTER, filtered)


class PeerFilter:
    """Filters the sockets of the middleware in this process as soon as they are there, in a thread of its own."""

    def __init__(self, peers: Iterable[str], domain: int) -> None:
        """Begin to look for sockets.

        Args:
            peers: Names or addresses of the hosts whose packets may pass, beside this one.
            domain: The ROS domain.

        Raises:
            ConfigError: A peer cannot be resolved, or the kernel knows no filters.
        """
        own = {
            entry.address
            for entries in psutil.net_if_addrs().values()
            for entry in entries
            if _is_ipv4(entry)
        }
        self._code = program(addresses_of(peers) | own)
        self._ports = ports_of_domain(domain)
        self._known: set[str] = set()
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            try:
                attach(probe, self._code)
            except OSError as error:
                raise ConfigError(
                    f"{STATIC_PEERS} is set, but this computer cannot filter packets ({error}): every host could "
                    "command the robot. Unset it, or close the ports by a firewall and set the range SUBNET."
                ) from error
        threading.Thread(target=self._run, name="peer filter", daemon=True).start()

    def _run(self) -> None:
        pause = threading.Event()
        while not pause.wait(LATER_S if self._known else SOON_S):
            self._look()

    def _look(self) -> None:
        """Filter the sockets that have none yet."""
        for fd in os.listdir(FDS):
            with contextlib.suppress(OSError):  # closed meanwhile
                name = os.readlink(FDS / fd)
                if name.startswith("socket:") and name not in self._known and self._filter(int(fd)):
                    self._known.add(name)

    def _filter(self, fd: int) -> bool:
        with socket.socket(fileno=os.dup(fd)) as sock:
            if (sock.family, sock.type) != (socket.AF_INET, socket.SOCK_DGRAM):
                return False
            if sock.getsockname()[1] not in self._ports:
                return False
            attach(sock, self._code)
            return True


def _is_ipv4(entry: object) -> bool:
    return getattr(entry, "family", None) == socket.AF_INET
