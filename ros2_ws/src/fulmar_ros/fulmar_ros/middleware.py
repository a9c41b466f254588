"""Fast DDS settings of every process of Fulmar, unless its environment has others."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator, Mapping
from pathlib import Path

DISCOVERY_RANGE, STATIC_PEERS = "ROS_AUTOMATIC_DISCOVERY_RANGE", "ROS_STATIC_PEERS"
OWN_HOST = "LOCALHOST"  # the range where the environment says nothing
# Jazzy's name of the file, and that of later ones.
PROFILES = ("FASTRTPS_DEFAULT_PROFILES_FILE", "FASTDDS_DEFAULT_PROFILES_FILE")
# All announce nodes early, and resend lost messages early. Those of loopback listen on 127.0.0.1 alone.
NETWORK = Path(__file__).with_name("fast_dds.xml")
PEERS = Path(__file__).with_name("fast_dds_peers.xml")
LOOPBACK = Path(__file__).with_name("fast_dds_loopback.xml")
OWN_PROFILES = {str(profile) for profile in (NETWORK, PEERS, LOOPBACK)}
# With LOCALHOST rmw_fastrtps adds transports of its own to those of a profile: shared memory, and one that sends on
# every interface. These profiles have all that is needed: they go with ranges at which rmw adds nothing, or, at SUBNET,
# the static peers alone.
RANGE_OF = {str(LOOPBACK): "SYSTEM_DEFAULT", str(PEERS): "SUBNET"}
_loaded: list[str] = []  # the profile of this process; Fast DDS reads it once


def discovery_range(environment: Mapping[str, str]) -> str:
    """How far the nodes of an environment are discovered: not on the network, unless it says so."""
    wanted, profile = environment.get(DISCOVERY_RANGE) or OWN_HOST, environment.get(PROFILES[0], "")
    return OWN_HOST if wanted == RANGE_OF.get(profile) else wanted


def static_peers(environment: Mapping[str, str]) -> list[str]:
    """Other hosts, by name or address, that the nodes of an environment talk to."""
    return [peer for peer in environment.get(STATIC_PEERS, "").split(";") if peer]


def foreign_profile(environment: Mapping[str, str]) -> str:
    """Path of a Fast DDS profile that is none of ours; empty if there is none."""
    named = (environment[name] for name in PROFILES if name in environment)
    return next((path for path in named if path not in OWN_PROFILES), "")


def own_profile(environment: Mapping[str, str]) -> Path:
    """The profile for the range and peers of an environment."""
    if discovery_range(environment) not in (OWN_HOST, "OFF"):
        return NETWORK
    return PEERS if static_peers(environment) else LOOPBACK


def middleware_environment(environment: Mapping[str, str] | None = None) -> dict[str, str]:
    """The variables that Fast DDS reads, as processes of an environment should have them, by default of this one."""
    environment = os.environ if environment is None else environment
    own = {DISCOVERY_RANGE: discovery_range(environment)}
    if not foreign_profile(environment):
        own |= dict.fromkeys(PROFILES, str(own_profile(environment)))
    return own


def environment_of_any_node(environment: Mapping[str, str]) -> dict[str, str]:
    """The same for processes that need not be of Fulmar, with the range that goes with the profile; see `RANGE_OF`.

    Nodes of Fulmar read it as what it stands for, see `discovery_range`.
    """
    own = middleware_environment(environment)
    range_for_profile = RANGE_OF.get(own.get(PROFILES[0], ""), own[DISCOVERY_RANGE])
    return own | ({DISCOVERY_RANGE: range_for_profile} if own[DISCOVERY_RANGE] == OWN_HOST else {})


def set_up_middleware() -> None:
    """Set them for this process; call before `rclpy.init`, or rather use `runtime.init_ros`."""
    os.environ |= middleware_environment()


@contextlib.contextmanager
def range_for_rclpy() -> Iterator[None]:
    """Set the discovery range that `rclpy.init` shall read, see `RANGE_OF`."""
    if not _loaded:
        _loaded.append(os.environ.get(PROFILES[0], ""))
    wanted = discovery_range(os.environ)
    chosen = os.environ.get(PROFILES[0], "")
    known = wanted == OWN_HOST and chosen == _loaded[0]
    os.environ[DISCOVERY_RANGE] = RANGE_OF.get(chosen, wanted) if known else wanted
    try:
        yield
    finally:
        os.environ[DISCOVERY_RANGE] = wanted


def strangers_can_send(environment: Mapping[str, str]) -> bool:
    """Whether nodes that talk to static peers alone listen on every interface, so that packets must be filtered."""
    ours = not foreign_profile(environment)
    return ours and discovery_range(environment) == OWN_HOST and bool(static_peers(environment))
