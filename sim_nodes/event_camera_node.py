"""The node `event_camera`: simulated event cameras of a satellite that look at the stars.

It reads the truth of a simulated plant, and publishes a packet of each camera's events for the time between two states,
in which the body is taken to turn at a constant rate.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from typing import Any

import numpy as np
from nav_msgs.msg import Odometry
from rclpy.node import Node
from rclpy.publisher import Publisher
from sensor_msgs.msg import PointCloud2

from fulmar_bags.message_reader import stamp_ns
from fulmar_core.config.errors import ConfigError
from fulmar_core.dynamics.sky.event_sensor import EventSensor
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.sensors.catalogue import load_stars
from fulmar_core.robots.sensors.ranges import attitude_problem
from fulmar_core.robots.topics import EVENTS, EVENTS_2, TRUTH
from fulmar_core.states.attitude import rotation_error
from fulmar_ros.event_packets import cloud_of_events
from fulmar_ros.lockstep_answer import LockstepAnswer
from fulmar_ros.operator_subscription import subscribe_every
from fulmar_ros.parameters import own_frames, read_parameters
from fulmar_ros.qos import EVERYTHING, publisher_qos, subscriber_qos
from fulmar_ros.runtime import RequestExit, run_node

LONGEST_NS = 1_000_000_000  # between two states: after a longer gap, or a jump back, pixels begin anew [ns]


@dataclass(frozen=True)
class EventCameraSettings:
    """ROS parameters of the event camera node."""

    robot: str = "cubesat_wheels"
    seed: int = 0
    lockstep: bool = False  # answer the periods of a plant in lock step
    upstream: tuple[str, ...] = ("",)  # in lock step: other nodes whose outputs are inputs of this one
    wait_for_subscribers: int = 0  # in lock step: of each output, before the first answer


class EventCameraNode(Node):
    """Turns true attitudes into events of every camera that the robot's file has."""

    def __init__(self, _request_exit: RequestExit, *, cli_args: list[str] | None = None) -> None:
        """Load the stars.

        Args:
            cli_args: ROS arguments of this node alone, where it shares a process.

        Raises:
            FulmarError: A parameter is wrong, the robot has no event camera, or the catalogue is not installed.
        """
        super().__init__("event_camera", cli_args=cli_args)
        settings = read_parameters(self, EventCameraSettings)
        robot, stars = load_robot(settings.robot), load_stars()
        if not robot.event_cameras:
            raise ConfigError(f"'{robot.name}' has no event camera. Add 'event_cameras' to its file.")
        frames, wires = own_frames(self, robot), (EVENTS, EVENTS_2)
        self._cameras: list[tuple[EventSensor, Publisher, str]] = []
        for each, wire in zip(robot.event_cameras, wires, strict=False):
            sensor = EventSensor(each.camera, each.pixels, stars, name=wire.name)
            sensor.reset(settings.seed, 0)
            qos = publisher_qos(wire, lockstep=settings.lockstep)
            frame = frames.named("event_camera" if wire is EVENTS else "event_camera_2")
            self._cameras.append((sensor, self.create_publisher(PointCloud2, wire.name, qos), frame))
        self._seed = settings.seed
        self._before: tuple[int, np.ndarray] | None = None  # stamp [ns] and attitude
        self._period: LockstepAnswer | None = None
        topic = self.resolve_topic_name(TRUTH.name)
        self._topic = topic
        if not settings.lockstep:
            subscribe_every(self, Odometry, TRUTH, self._on_truth, depth=10)
        else:
            qos = subscriber_qos(TRUTH, reliable=True, depth=EVERYTHING, lossless=True)
            self.create_subscription(Odometry, TRUTH.name, self._on_truth, qos)
            self._period = LockstepAnswer(
                self,
                {topic: "truth"},
                self._compute,
                [publisher for _, publisher, _ in self._cameras],
                upstream=[node for node in settings.upstream if node],
                wait_for_subscribers=settings.wait_for_subscribers,
            )

    def _on_truth(self, message: Odometry) -> None:
        time_ns, q = stamp_ns(message.header.stamp), message.pose.pose.orientation
        quat = np.array([q.x, q.y, q.z, q.w])
        if self._period is not None:
            self._period.add(self._topic, time_ns, (time_ns, quat))
            return
        for publisher, packet in self._exposed(time_ns, quat):
            publisher.publish(packet)

    def _compute(self, _period_ns: int, readings: list[tuple[str, Any]]) -> list[tuple[Publisher, Any]]:
        return [packet for _, truth in readings for packet in self._exposed(*truth)]

    def _exposed(self, time_ns: int, quat: np.ndarray) -> list[tuple[Publisher, PointCloud2]]:
        """Packets of every camera from the state before to this one."""
        if attitude_problem(quat):
            return []  # a state that is none shows no stars
        if self._before is not None and self._before[0] == time_ns:
            return []  # a plant that waits for an answer sends its state again
        before, self._before = self._before, (time_ns, quat)
        if before is None:
            return []
        passed_ns = time_ns - before[0]
        if not 0 < passed_ns <= LONGEST_NS:
            for sensor, _, _ in self._cameras:
                sensor.reset(self._seed, 0)
            return []
        rate = np.array(rotation_error(tuple(before[1]), tuple(quat))) / (passed_ns / 1e9)
        return [
            (publisher, cloud_of_events(sensor.expose(before[1], rate, before[0], passed_ns), time_ns, frame))
            for sensor, publisher, frame in self._cameras
        ]


def main() -> None:
    """Run the node until it is stopped."""
    sys.exit(run_node(EventCameraNode))


if __name__ == "__main__":
    main()
