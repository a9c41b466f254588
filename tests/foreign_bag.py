"""Bags as other programs record them: written by `rosbags`, with odometry under names of their own."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from rosbags.rosbag2 import Writer
from rosbags.rosbag2.enums import CompressionFormat, CompressionMode, StoragePlugin

from fulmar_bags.message_types import type_store

NS = 1_000_000_000
TWIST = "geometry_msgs/msg/Twist"
ODOMETRY = "nav_msgs/msg/Odometry"


def write_foreign(
    folder: Path,
    storage: StoragePlugin,
    *,
    count: int = 200,
    topic: str = "/base/odometry",
    compression: CompressionMode = CompressionMode.NONE,
    stamped: bool = True,
    commands: bool = False,
    velocity: str = "/cmd_vel",
    more: tuple[str, ...] = (),
) -> Path:
    """A circle of half a metre at 0.5 m/s and 50 Hz, in frames `map` and `base_footprint`, with a text beside it.

    With commands, a Twist of a tenth of its number and 1 rad/s comes 5 ms after each odometry, on the topic `velocity`.
    Each topic of `more` has the same odometry.
    """
    store = type_store()
    new = store.types
    writer = Writer(folder, version=9, storage_plugin=storage)
    writer.set_compression(compression, CompressionFormat.ZSTD)
    with writer:
        odometries = [writer.add_connection(name, ODOMETRY, typestore=store) for name in (topic, *more)]
        words = writer.add_connection("/words", "std_msgs/msg/String", typestore=store)
        velocity = writer.add_connection(velocity, TWIST, typestore=store) if commands else None
        for i in range(count):
            time_ns, angle = 5 * NS + i * 20_000_000, 0.02 * i
            message = new[ODOMETRY](
                header=new["std_msgs/msg/Header"](
                    stamp=new["builtin_interfaces/msg/Time"](*(divmod(time_ns, NS) if stamped else (0, 0))),
                    frame_id="map",
                ),
                child_frame_id="base_footprint",
                pose=new["geometry_msgs/msg/PoseWithCovariance"](
                    pose=new["geometry_msgs/msg/Pose"](
                        position=new["geometry_msgs/msg/Point"](
                            x=0.5 * np.cos(angle), y=0.5 * np.sin(angle), z=0.0
                        ),
                        orientation=new["geometry_msgs/msg/Quaternion"](
                            x=0.0, y=0.0, z=np.sin(angle / 2), w=np.cos(angle / 2)
                        ),
                    ),
                    covariance=np.zeros(36),
                ),
                twist=new["geometry_msgs/msg/TwistWithCovariance"](
                    twist=new["geometry_msgs/msg/Twist"](
                        linear=new["geometry_msgs/msg/Vector3"](x=0.0, y=0.5, z=0.0),
                        angular=new["geometry_msgs/msg/Vector3"](x=0.0, y=0.0, z=1.0),
                    ),
                    covariance=np.zeros(36),
                ),
            )
            log_ns = 1_700_000_000 * NS + time_ns + (i % 5) * 100_000
            for odometry in odometries:
                writer.write(odometry, log_ns, store.serialize_cdr(message, ODOMETRY))
            if commands:
                zero = dict.fromkeys("xyz", 0.0)
                twist = new["geometry_msgs/msg/Twist"](
                    linear=new["geometry_msgs/msg/Vector3"](**{**zero, "x": 0.1 * i}),
                    angular=new["geometry_msgs/msg/Vector3"](**{**zero, "z": 1.0}),
                )
                writer.write(velocity, log_ns + 5_000_000, store.serialize_cdr(twist, TWIST))
            if i % 50 == 0:
                text = new["std_msgs/msg/String"](data=f"word {i}")
                writer.write(words, log_ns, store.serialize_cdr(text, "std_msgs/msg/String"))
    return folder
