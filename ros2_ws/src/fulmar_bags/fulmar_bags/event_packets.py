"""Packets of events as points of `sensor_msgs/PointCloud2`: x, y uint16, t uint64 [ns], p uint8. No ROS."""

from __future__ import annotations

from typing import Any

import numpy as np

from fulmar_core.dynamics.sky.events import Events, as_polarities

POINT = np.dtype([("x", "<u2"), ("y", "<u2"), ("t", "<u8"), ("p", "u1")])
UINT8, UINT16, UINT32 = 2, 4, 6  # of sensor_msgs/PointField
# Name, offset, type and count. PointField has no number for 64 bits: `t` is two of 32 bits, the lower one first.
FIELDS = (("x", 0, UINT16, 1), ("y", 2, UINT16, 1), ("t", 4, UINT32, 2), ("p", 12, UINT8, 1))


def points_of(events: Events) -> bytes:
    """Data of a message, point after point."""
    points = np.empty(len(events), dtype=POINT)
    for name in ("x", "y", "t", "p"):
        points[name] = getattr(events, name)
    return points.tobytes()


def events_of_cloud(message: Any) -> tuple[Events | None, str]:
    """The packet of a message, of a camera whose size it does not say (0), or why it is none."""
    found = tuple((field.name, field.offset, field.datatype, field.count) for field in message.fields)
    size = message.width * message.height
    if found != FIELDS or message.point_step != POINT.itemsize or message.is_bigendian:
        return (
            None,
            "its fields are not x, y (uint16), t (uint64 as two uint32) and p (uint8), packed in this order",
        )
    data = bytes(message.data)
    if len(data) != size * POINT.itemsize:
        return None, f"it has {len(data)} bytes, and {size} events have {size * POINT.itemsize}"
    points = np.frombuffer(data, dtype=POINT)
    return Events(points["x"], points["y"], points["t"], as_polarities(points["p"]), 0, 0), ""
