"""Writes packets of events into a bag, as an event camera's node publishes them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fulmar_bags.event_packets import FIELDS, POINT, points_of
from fulmar_bags.message_types import type_store
from fulmar_bags.writer import BagWriter
from fulmar_core.dynamics.sky.events import Events
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.sensors.star_camera import StarCamera
from fulmar_core.robots.topics import EVENTS, EVENTS_2
from fulmar_core.wires.robot_name import frames_of, namespace_of

CAMERAS = "event_cameras"  # entry of the bag's record: width, height [px] and field of view [deg] of each
FRAMES = {"events": "event_camera", "events_2": "event_camera_2"}


class EventBag:
    """A bag with the packets of one or two cameras; its times of recording are those of the packets."""

    def __init__(
        self, folder: Path, robot: Robot, cameras: Sequence[StarCamera], recordings: Sequence[str]
    ) -> None:
        """Create it, with what its packets come from.

        Raises:
            BagError: As in `BagWriter`.
        """
        self._store, self._frames = type_store(), frames_of(robot.name, robot.name)
        self._writer = BagWriter(
            folder,
            run_info={
                "robot": robot.name,
                "recordings": list(recordings),
                CAMERAS: [[camera.width, camera.height, camera.fov_deg] for camera in cameras],
            },
        )
        space = namespace_of(robot.name)
        self._topics = {
            name: f"{space}/{wire.name}" for name, wire in zip(FRAMES, (EVENTS, EVENTS_2), strict=True)
        }
        for name, wire in zip(FRAMES, (EVENTS, EVENTS_2), strict=True):
            self._writer.add_topic(self._topics[name], wire.type, wire.delivery)

    def add(self, packet: tuple[int, str, Events]) -> None:
        """Write a packet: its end [ns], which camera's, and its events."""
        end_ns, name, events = packet
        data = self._store.serialize_cdr(self._message(end_ns, name, events), "sensor_msgs/msg/PointCloud2")
        self._writer.write(self._topics[name], bytes(data), log_ns=end_ns)

    def close(self) -> None:
        """Finish the bag."""
        self._writer.close()

    def _message(self, end_ns: int, name: str, events: Events) -> Any:
        types = self._store.types
        stamp = types["builtin_interfaces/msg/Time"](sec=end_ns // 10**9, nanosec=end_ns % 10**9)
        return types["sensor_msgs/msg/PointCloud2"](
            header=types["std_msgs/msg/Header"](stamp=stamp, frame_id=self._frames.named(FRAMES[name])),
            height=1,
            width=len(events),
            fields=[
                types["sensor_msgs/msg/PointField"](name=n, offset=o, datatype=t, count=c)
                for n, o, t, c in FIELDS
            ],
            is_bigendian=False,
            point_step=POINT.itemsize,
            row_step=POINT.itemsize * len(events),
            data=np.frombuffer(points_of(events), dtype=np.uint8),
            is_dense=True,
        )
