"""Checks of what connects processes: ROS domain and discovery range, multicast, shared memory, a message over DDS."""

from __future__ import annotations

import os
import socket
from collections.abc import Mapping
from pathlib import Path

from fulmar_bringup.domains import DOMAINS
from fulmar_cli.diagnosis.check_result import Finding
from fulmar_ros.middleware import (
    DISCOVERY_RANGE,
    PROFILES,
    STATIC_PEERS,
    discovery_range,
    foreign_profile,
    static_peers,
)
from fulmar_ros.middleware import OWN_HOST as OURS
from fulmar_ros.ros_check import domain_problem

RANGES = ("SUBNET", "LOCALHOST", "OFF", "SYSTEM_DEFAULT")
GROUP = "239.255.0.1"  # of DDS discovery (OMG DDSI-RTPS 2.5, 9.6.2)
LOOPBACK = "127.0.0.1"
RECEIVE_LIMIT = Path("/proc/sys/net/core/rmem_max")
RECEIVE_BYTES = 4_194_304  # of fast_dds.xml
ROS_FIX = (
    "sudo ip link set lo up && ROS_DOMAIN_ID=77 fulmar doctor   # without loopback, or in a domain in use"
)


def check_discovery(environment: Mapping[str, str], *, hardware: bool) -> Finding:
    """Whether nodes find one another as far as they have to.

    Args:
        environment: Environment of the nodes.
        hardware: Whether a robot shall be seen from other computers.
    """
    what, reach = "discovery", discovery_range(environment)
    domain = environment.get("ROS_DOMAIN_ID") or "0"
    found = f"range {reach}, domain {domain}"
    if reach not in RANGES:
        found = f"{DISCOVERY_RANGE} = '{reach}' must be one of {', '.join(RANGES)}"
        return Finding(what, "wrong", found, f"export {DISCOVERY_RANGE}={OURS}")
    if problem := domain_problem(environment):
        return Finding(what, "wrong", problem, "export ROS_DOMAIN_ID=0")
    if reach == "OFF":
        return Finding(what, "wrong", f"{found}: no node finds another", f"export {DISCOVERY_RANGE}={OURS}")
    if environment.get("ROS_LOCALHOST_ONLY", "0") == "1":
        found = f"{found}, but ROS_LOCALHOST_ONLY=1 overrules it and is deprecated"
        return Finding(what, "advice", found, "unset ROS_LOCALHOST_ONLY")
    if int(domain) > DOMAINS[-1]:
        found = f"{found}: its ports are among those that Linux gives to other programs"
        return Finding(what, "advice", found, f"export ROS_DOMAIN_ID={DOMAINS[-1]}   # or less")
    peers = static_peers(environment)
    if peers:
        found = f"{found}, peers {', '.join(peers)}"
    elif hardware and reach == OURS:
        found = f"{found}: no other computer reaches the robot"
        return Finding(
            what,
            "advice",
            found,
            f"export {STATIC_PEERS}=ADDRESS   # of the operator's computer, docs/security.md",
        )
    elif hardware:
        found = f"{found}: every computer of the network can command the robot"
        return Finding(
            what, "advice", found, f"unset {DISCOVERY_RANGE}   # and set {STATIC_PEERS}, docs/security.md"
        )
    return Finding(what, "ok", found)


def check_multicast(
    environment: Mapping[str, str], *, address: str | None = None, timeout_s: float = 1.0
) -> Finding:
    """Send one multicast datagram and receive it: through loopback, or through the network where discovery uses it.

    Args:
        environment: Environment of the nodes.
        address: Of the interface; by default that of the discovery range.
        timeout_s: Longest wait for the datagram [s].
    """
    wide = (discovery_range(environment)) not in ("LOCALHOST", "OFF")
    try:
        address = address or (_address_of_route() if wide else LOOPBACK)
        _send_and_receive(address, GROUP, timeout_s)
    except OSError as error:
        where = address or "the network"
        found = f"no multicast through {where}: {error.strerror or 'nothing came back'}"
        if not wide:
            return _without_multicast(found, timeout_s)
        fix = "sudo ufw allow in proto udp to 224.0.0.0/4 && sudo ufw allow in proto udp from 224.0.0.0/4"
        if address is None:
            fix = f"export {DISCOVERY_RANGE}=LOCALHOST   # or connect this computer to a network"
        return Finding("multicast", "wrong", found, fix)
    return Finding("multicast", "ok", f"sent and received through {address}")


def _without_multicast(found: str, timeout_s: float) -> Finding:
    """Nodes of one computer find one another by unicast, too (measured), as long as loopback is up."""
    try:
        _send_and_receive(LOOPBACK, LOOPBACK, timeout_s)
    except OSError:
        return Finding(
            "multicast", "wrong", f"{found}; loopback is down", "sudo ip link set lo up multicast on"
        )
    fix = "sudo ip link set lo multicast on && sudo sysctl net.ipv4.igmp_max_memberships=20"
    return Finding("multicast", "advice", found, fix)


def check_receive_buffer(limit: Path = RECEIVE_LIMIT) -> Finding:
    """Whether sockets may keep what comes while a node is held up; the profiles ask for `RECEIVE_BYTES`.

    Args:
        limit: File in which the kernel says the most that a socket gets [bytes].
    """
    what = "receive buffer"
    try:
        most = int(limit.read_text())
    except (OSError, ValueError):
        return Finding(what, "ok", "the system states no limit")
    found = f"up to {most / 1e6:.1f} MB a socket"
    if most >= RECEIVE_BYTES:
        return Finding(what, "ok", found)
    return Finding(
        what,
        "advice",
        f"{found}: a node that is held up for some tenths of a second can miss messages",
        f"sudo sysctl -w net.core.rmem_max={RECEIVE_BYTES}",
    )


def check_profile(environment: Mapping[str, str]) -> Finding:
    """Whether a Fast DDS profile of the user's own may let the nodes share memory, see fast_dds.xml."""
    path = foreign_profile(environment)
    if not path:
        return Finding("profile", "ok", "nodes speak by UDP")
    found = f"{path} is yours: in shared memory a node that dies or hangs can block the others for 2 s"
    return Finding(
        "profile", "advice", found, f"unset {' '.join(PROFILES)}   # or useBuiltinTransports=false in it"
    )


def check_round_trip(timeout_s: float = 5.0) -> Finding:
    """Whether a message to oneself comes back over DDS, and how soon.

    Args:
        timeout_s: Longest wait for a message [s].
    """
    what = "ROS 2 publish and receive"
    try:
        from fulmar_bringup.ros_echo import round_trip_ms

        best = round_trip_ms(timeout_s)
    except Exception as error:  # noqa: BLE001 - whatever keeps ROS from working is the finding
        return Finding(what, "wrong", f"{type(error).__name__}: {error}", ROS_FIX)
    if best is None:
        return Finding(what, "wrong", f"no message came back within {timeout_s:g} s", ROS_FIX)
    domain = os.environ.get("ROS_DOMAIN_ID", "0")
    return Finding(what, "ok", f"{best:.2f} ms (median) in domain {domain}")


def check_running_robots() -> Finding:
    """Whether what is published for the robots of this domain can reach them."""
    try:
        from fulmar_bringup.robot_operator import operator

        with operator() as person:
            robots, unfit = person.look_at_wires()
    except Exception as error:  # noqa: BLE001 - whatever keeps ROS from working is the finding
        return Finding("running robots", "wrong", f"{type(error).__name__}: {error}", ROS_FIX)
    if unfit:
        fix = "ros2 topic info --verbose TOPIC   # that publisher needs the type and the reliability of the subscriber"
        return Finding("running robots", "wrong", "; ".join(unfit), fix)
    names = ", ".join(sorted(space.strip("/") for space in robots)) or "none in this domain"
    return Finding("running robots", "ok", names)


def _address_of_route() -> str:
    """Address of the interface that multicast leaves by; nothing is sent."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.connect((GROUP, 7400))
        return str(probe.getsockname()[0])


def _send_and_receive(address: str, to: str, timeout_s: float) -> None:
    """One datagram through an interface, to the group or to the interface itself.

    Raises:
        OSError: It was not sent, or did not come back.
    """
    interface, token = socket.inet_aton(address), os.urandom(16)
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender,
    ):
        receiver.bind(("", 0))
        receiver.settimeout(timeout_s)
        if to == GROUP:
            joined = socket.inet_aton(GROUP) + interface
            receiver.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, joined)
        sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, interface)
        sender.sendto(token, (to, receiver.getsockname()[1]))
        while receiver.recv(64) != token:
            pass
