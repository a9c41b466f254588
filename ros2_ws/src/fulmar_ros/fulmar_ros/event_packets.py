"""Packets of events as messages of ROS; see `fulmar_bags.event_packets`."""

from __future__ import annotations

from sensor_msgs.msg import PointCloud2, PointField

from fulmar_bags.event_packets import FIELDS, POINT, points_of
from fulmar_core.dynamics.sky.events import Events
from fulmar_ros.convert import stamp_of


def cloud_of_events(events: Events, end_ns: int, frame: str) -> PointCloud2:
    """A message of a packet that ends at a time [ns], in the camera's frame."""
    message = PointCloud2(height=1, width=len(events), is_dense=True, point_step=POINT.itemsize)
    message.header.stamp, message.header.frame_id = stamp_of(end_ns), frame
    message.row_step = POINT.itemsize * len(events)
    message.fields = [PointField(name=n, offset=o, datatype=t, count=c) for n, o, t, c in FIELDS]
    message.data.frombytes(points_of(events))
    return message
