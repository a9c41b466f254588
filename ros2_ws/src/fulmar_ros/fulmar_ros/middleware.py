"""Fast DDS settings of every process of Fulmar, unless its environment has others."""

from __future__ import annotations

import os
from pathlib import Path

DISCOVERY_RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE"
TRANSPORTS, UDP_ONLY = (
    "FASTDDS_BUILTIN_TRANSPORTS",
    "UDPv4",
)  # between containers or users: without shared memory
# Jazzy's name of the file, and that of later ones.
PROFILES = ("FASTRTPS_DEFAULT_PROFILES_FILE", "FASTDDS_DEFAULT_PROFILES_FILE")
# Announces nodes early, and resends lost messages early.
OWN_PROFILES = Path(__file__).with_name("fast_dds.xml")


def middleware_environment() -> dict[str, str]:
    """The variables that Fast DDS reads, as this process or a child of it should have them."""
    own = {DISCOVERY_RANGE: os.environ.get(DISCOVERY_RANGE, "LOCALHOST")}  # not visible on the network
    if not any(name in os.environ for name in PROFILES):
        own |= dict.fromkeys(PROFILES, str(OWN_PROFILES))
    return own


def set_up_middleware() -> None:
    """Set them for this process; call before `rclpy.init`."""
    os.environ |= middleware_environment()
