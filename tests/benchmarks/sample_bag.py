"""A bag of simulated samples, written without ROS, with the topics that a plant publishes."""

from __future__ import annotations

from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np

from fulmar_bags.message_types import type_store
from fulmar_bags.writer import BagWriter
from fulmar_core.robot import Robot
from fulmar_core.robot_name import namespace_of
from fulmar_core.rotation import rotate_inverse
from fulmar_core.state import RigidBodyState
from fulmar_core.topics import ACTUATORS_STATE, ODOMETRY, Wire

NS = 1_000_000_000


class SampleBag:
    """Odometry and applied commands of one run; closed at the end of a `with`."""

    def __init__(self, folder: Path, robot: Robot) -> None:
        """Create the bag.

        Args:
            folder: Absent or empty.
            robot: Whose run it is.
        """
        self._robot, self._store = robot, type_store()
        self._writer = BagWriter(folder, run_info={"robot": robot.name})
        self._kinds = self._store.types
        for wire in (ODOMETRY, ACTUATORS_STATE):
            self._writer.add_topic(self._topic(wire), wire.type, wire.delivery)

    def __enter__(self) -> SampleBag:
        """The bag itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close it."""
        self._writer.close()

    def odometry(self, state: RigidBodyState, time_s: float) -> None:
        """Add a measured state."""
        velocity = rotate_inverse(state.quat_xyzw, state.velocity_in_world)
        pose = self._new(
            "geometry_msgs/msg/Pose",
            position=self._vector("Point", state.position_in_world),
            orientation=self._vector("Quaternion", state.quat_xyzw),
        )
        twist = self._new(
            "geometry_msgs/msg/Twist",
            linear=self._vector("Vector3", velocity),
            angular=self._vector("Vector3", state.angular_velocity_in_body),
        )
        unknown = np.zeros(36)
        message = self._new(
            "nav_msgs/msg/Odometry",
            header=self._header(time_s),
            child_frame_id="base_link",
            pose=self._new("geometry_msgs/msg/PoseWithCovariance", pose=pose, covariance=unknown),
            twist=self._new("geometry_msgs/msg/TwistWithCovariance", twist=twist, covariance=unknown),
        )
        self._write(ODOMETRY, message, time_s)

    def applied(self, command: np.ndarray, time_s: float) -> None:
        """Add what the actuators do from a time on."""
        none = np.zeros(0)
        message = self._new(
            "sensor_msgs/msg/JointState",
            header=self._header(time_s),
            name=list(self._robot.actuators.names),
            position=none,
            velocity=none,
            effort=np.asarray(command, dtype=float),
        )
        self._write(ACTUATORS_STATE, message, time_s)

    def _topic(self, wire: Wire) -> str:
        return f"{namespace_of(self._robot.name)}/{wire.name}"

    def _write(self, wire: Wire, message: Any, time_s: float) -> None:
        data = bytes(self._store.serialize_cdr(message, wire.type))
        self._writer.write(self._topic(wire), data, log_ns=_ns(time_s))

    def _new(self, kind: str, **parts: Any) -> Any:
        return self._kinds[kind](**parts)

    def _vector(self, kind: str, values: np.ndarray) -> Any:
        names = "xyzw"[: len(values)]
        return self._new(f"geometry_msgs/msg/{kind}", **dict(zip(names, map(float, values), strict=True)))

    def _header(self, time_s: float) -> Any:
        ns = _ns(time_s)
        stamp = self._new("builtin_interfaces/msg/Time", sec=ns // NS, nanosec=ns % NS)
        return self._new("std_msgs/msg/Header", stamp=stamp, frame_id="odom")


def _ns(time_s: float) -> int:
    """One second after the epoch: a stamp of 0 means none."""
    return round((time_s + 1.0) * NS)
