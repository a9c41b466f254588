"""Packets of events as `sensor_msgs/PointCloud2`: one point an event, fields x, y uint16, t uint64 [ns], p uint8."""

from __future__ import annotations

import numpy as np
from sensor_msgs.msg import PointCloud2, PointField

from fulmar_core.sky.events import Events
from fulmar_ros.convert import stamp_of

# PointField has no number for 64-bit integers: `t` is two of 32 bits, the lower one first.
POINT = np.dtype([("x", "<u2"), ("y", "<u2"), ("t", "<u8"), ("p", "u1")])
FIELDS = (
    ("x", 0, PointField.UINT16, 1),
    ("y", 2, PointField.UINT16, 1),
    ("t", 4, PointField.UINT32, 2),
    ("p", 12, PointField.UINT8, 1),
)


def cloud_of_events(events: Events, end_ns: int, frame: str) -> PointCloud2:
    """A message of a packet that ends at a time [ns], in the camera's frame."""
    points = np.empty(len(events), dtype=POINT)
    for name in ("x", "y", "t", "p"):
        points[name] = getattr(events, name)
    message = PointCloud2(height=1, width=len(events), is_dense=True, point_step=POINT.itemsize)
    message.header.stamp, message.header.frame_id = stamp_of(end_ns), frame
    message.row_step = POINT.itemsize * len(events)
    message.fields = [PointField(name=n, offset=o, datatype=t, count=c) for n, o, t, c in FIELDS]
    message.data.frombytes(points.tobytes())
    return message


def events_of_cloud(message: PointCloud2) -> tuple[Events | None, str]:
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
    return Events(points["x"], points["y"], points["t"], points["p"], 0, 0), ""
