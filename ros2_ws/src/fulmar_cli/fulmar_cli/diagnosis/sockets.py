"""Whether the sockets of ROS nodes on this computer can be reached from the network."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import psutil

from fulmar_cli.diagnosis.check_result import Finding
from fulmar_ros.middleware import (
    DISCOVERY_RANGE,
    OWN_HOST,
    PROFILES,
    discovery_range,
    foreign_profile,
    static_peers,
)
from fulmar_ros.rtps_ports import ports_of_domain

WHAT = "sockets"
LOOPBACK_NET = "127."


@dataclass(frozen=True)
class Listener:
    """A UDP socket on which a process of this computer listens."""

    address: str
    port: int
    process: str  # name and id; empty where it is another user's

    @property
    def is_open(self) -> bool:
        """Whether packets of other hosts reach it."""
        return not self.address.startswith(LOOPBACK_NET)


def listeners(domain: int) -> list[Listener]:
    """Sockets of the middleware in a ROS domain, of every process that may be seen."""
    ports = ports_of_domain(domain)
    found = [
        Listener(one.laddr.ip, one.laddr.port, _process(one.pid))
        for one in psutil.net_connections(kind="udp4")
        if one.laddr and one.laddr.port in ports
    ]
    return sorted(found, key=lambda listener: (listener.port, listener.address))


def check_sockets(environment: Mapping[str, str], *, found: Iterable[Listener] | None = None) -> Finding:
    """Whether nodes that run now can be reached from other hosts, against what the environment promises.

    Args:
        environment: Environment of the nodes.
        found: Sockets to look at; by default those of the environment's domain.
    """
    text = environment.get("ROS_DOMAIN_ID") or "0"
    domain = int(text) if text.isdecimal() else 0
    found = listeners(domain) if found is None else list(found)
    exposed = [listener for listener in found if listener.is_open]
    if not exposed:
        text = f"{len(found)} of domain {domain}, all on loopback" if found else f"none in domain {domain}"
        return Finding(WHAT, "ok", text)
    who = ", ".join(sorted({one.process or "a process of another user" for one in exposed}))
    where = ", ".join(sorted({f"{one.address}:{one.port}" for one in exposed})[:4])
    return Finding(
        WHAT,
        "advice",
        f"{who} can be reached from the network ({where}): {_cause(environment)}",
        _fix(environment),
    )


def _cause(environment: Mapping[str, str]) -> str:
    """Why sockets may be open, as far as the environment says."""
    if profile := foreign_profile(environment):
        return f"the profile {profile} decides where nodes listen, whoever reaches it commands the robot"
    if discovery_range(environment) != OWN_HOST:
        return f"range {discovery_range(environment)}, whoever reaches it commands the robot"
    if static_peers(environment):
        return "nodes of Fulmar drop packets of all hosts but the static peers, other programs do not"
    return "not as Fulmar starts its nodes, whoever reaches it commands the robot"


def _fix(environment: Mapping[str, str]) -> str:
    if foreign_profile(environment):
        return f"unset {' '.join(PROFILES)}   # or give its UDP transport an interfaceWhiteList"
    if discovery_range(environment) != OWN_HOST or static_peers(environment):
        return "a firewall, see docs/security.md"
    return f"export {DISCOVERY_RANGE}={OWN_HOST}   # and start that process again"


def _process(pid: int | None) -> str:
    if pid is None:
        return ""
    with contextlib.suppress(psutil.Error):
        return f"{psutil.Process(pid).name()} (process {pid})"
    return f"process {pid}"
