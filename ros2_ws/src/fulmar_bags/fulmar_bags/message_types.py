"""What a bag says about message types: definition text, type hash and quality of service.

The texts come from the Jazzy type store of `rosbags`, so a bag can be written without ROS.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any

from rosbags.typesys import Stores, get_typestore
from rosbags.typesys.store import Typestore

from fulmar_core.errors import BagError
from fulmar_core.topics import Delivery

# What rmw reports for a duration that nobody set.
_FOREVER = {"sec": 9223372036, "nsec": 854775807}


@dataclass(frozen=True)
class MessageType:
    """One message type as a bag describes it."""

    name: str
    definition: str  # text in the `ros2msg` schema encoding
    hash: str  # RIHS01


@functools.cache
def type_store() -> Typestore:
    """Every message type of Jazzy."""
    return get_typestore(Stores.ROS2_JAZZY)


@functools.cache
def message_type(name: str) -> MessageType:
    """Describe a message type.

    Args:
        name: Such as `nav_msgs/msg/Odometry`.

    Raises:
        BagError: Jazzy has no such type.
    """
    store = type_store()
    if name not in store.fielddefs:
        raise BagError(f"message type '{name}' is not one of Jazzy's. Record only types that Jazzy has.")
    return MessageType(name, store.generate_msgdef(name, ros_version=2)[0], store.hash_rihs01(name))


def offered_qos(delivery: Delivery) -> list[dict[str, Any]]:
    """Quality of service of a wire's publishers, as rosbag2 version 9 writes it."""
    return [
        {
            "history": "keep_last",
            "depth": 1 if delivery == "latched" else 10,
            "reliability": "best_effort" if delivery == "best_effort" else "reliable",
            "durability": "transient_local" if delivery == "latched" else "volatile",
            "deadline": _FOREVER,
            "lifespan": _FOREVER,
            "liveliness": "automatic",
            "liveliness_lease_duration": _FOREVER,
            "avoid_ros_namespace_conventions": False,
        }
    ]
