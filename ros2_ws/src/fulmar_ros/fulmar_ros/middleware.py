"""How Fast DDS is set up for every process of Fulmar, unless its environment says otherwise.

UDP, and not shared memory: a process that is killed, or that stands still, while it holds the lock of a port in shared
memory can leave every other process deaf to what comes through that port (eProsima/Fast-DDS#6117,
ros2/rmw_fastrtps#908), and what it leaves behind fills /dev/shm (eProsima/Fast-DDS#2790). Sockets are the kernel's:
they go with their process.
"""

from __future__ import annotations

import os
from pathlib import Path

DEFAULTS = {
    "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",  # nobody on the network finds us
    "FASTDDS_BUILTIN_TRANSPORTS": "UDPv4",
}
# Jazzy's name of the file, and that of later ones.
PROFILES = ("FASTRTPS_DEFAULT_PROFILES_FILE", "FASTDDS_DEFAULT_PROFILES_FILE")
OWN_PROFILES = Path(__file__).with_name("fast_dds.xml")  # sends again soon what got lost


def middleware_environment() -> dict[str, str]:
    """The variables that Fast DDS reads, as this process or a child of it should have them."""
    own = {name: os.environ.get(name, value) for name, value in DEFAULTS.items()}
    if not any(name in os.environ for name in PROFILES):
        own |= dict.fromkeys(PROFILES, str(OWN_PROFILES))
    return own


def set_up_middleware() -> None:
    """Set them for this process; call before `rclpy.init`."""
    os.environ |= middleware_environment()
