"""The node `camera`: what the camera of a simulated robot sees.

It reads the truth of a simulated plant, and draws what is there from the robot's pose alone, without a step of any
simulation: a plant by the clock does not wait for it. In lock step it answers each period, with one image of each kind
where one is due.
"""

from __future__ import annotations

import os
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Odometry
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.publisher import Publisher
from sensor_msgs.msg import CameraInfo, Image

from fulmar_bags.message_reader import stamp_ns
from fulmar_core.config.errors import ConfigError
from fulmar_core.config.yielding import BEHIND
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.sensors.camera import OPTICAL
from fulmar_core.robots.sensors.ranges import attitude_problem
from fulmar_core.robots.topics import CAMERA_IMAGES, CAMERA_INFO, TRUTH
from fulmar_core.tasks import load_task
from fulmar_ros.camera_messages import image_messages, info_of
from fulmar_ros.health import Health
from fulmar_ros.lockstep_answer import LockstepAnswer
from fulmar_ros.parameters import name_of, own_frames, read_parameters
from fulmar_ros.qos import EVERYTHING, publisher_qos, subscriber_qos
from fulmar_ros.runtime import RequestExit, run_node
from sim_nodes.camera.backdrop import backdrop_of
from sim_nodes.camera.frame_times import FrameTimes
from sim_nodes.camera.renderer import Renderer

HEALTH_S = 1.0


@dataclass(frozen=True)
class CameraSettings:
    """ROS parameters of the camera node."""

    robot: str = "cubesat_8"
    task: str = "go_to_pose_3d"  # what moves or stands in the robot's world
    thing: str = ""  # in space, in the place of that of the task; empty: as the task has it
    lockstep: bool = False  # answer the periods of a plant in lock step
    upstream: tuple[str, ...] = ("",)  # in lock step: other nodes whose outputs are inputs of this one
    wait_for_subscribers: int = 0  # in lock step: of each output, before the first answer


class CameraNode(Node):
    """Publishes colours, depth and semantic ids, each with the stamp of the state that they were drawn from."""

    def __init__(self, _request_exit: RequestExit, *, cli_args: list[str] | None = None) -> None:
        """Build the scene, and get ready to draw.

        Args:
            cli_args: ROS arguments of this node alone, where it shares a process.

        Raises:
            FulmarError: A parameter is wrong, the robot has no camera, or nothing can draw here.
        """
        super().__init__("camera", cli_args=cli_args)
        settings = read_parameters(self, CameraSettings)
        robot, task = load_robot(settings.robot), load_task(settings.task, settings.thing)
        camera = robot.sensors.camera
        if camera is None:
            raise ConfigError(f"'{robot.name}' has no camera. Add 'camera' to 'sensors' in its file.")
        blocks = {thing.name: thing.body for thing in task.things if thing.body is not None}
        # OpenGL belongs to one thread, and callbacks come in another one than this.
        self._drawing = ThreadPoolExecutor(1, "drawing")
        make = partial(Renderer, camera, task.structures, backdrop=backdrop_of(robot), blocks=blocks)
        self._renderer = self._drawing.submit(make).result()
        self._frame = own_frames(self, robot).named(OPTICAL)
        self._info = info_of(camera, self._frame)
        self._times = FrameTimes(camera.rate_hz)
        self._poses: dict[str, np.ndarray] = {}  # of blocks, by name
        self._spent_s = 0.0
        qos = partial(publisher_qos, lockstep=settings.lockstep)
        self._images = [self.create_publisher(Image, wire.name, qos(wire)) for wire in CAMERA_IMAGES]
        self._infos = self.create_publisher(CameraInfo, CAMERA_INFO.name, qos(CAMERA_INFO))
        self._period: LockstepAnswer | None = None
        wires = {thing.wire: thing.name for thing in task.things if thing.name in blocks}
        self._topics = {TRUTH.name: self.resolve_topic_name(TRUTH.name)}
        self._topics |= {name: self.resolve_topic_name(wire.name) for wire, name in wires.items()}
        newest = (
            partial(subscriber_qos, reliable=True, depth=EVERYTHING, lossless=True)
            if settings.lockstep
            else subscriber_qos
        )
        for wire, name in wires.items():
            receive = partial(self._on_block, name)
            self.create_subscription(PoseStamped, wire.name, receive, newest(wire))
        self.create_subscription(Odometry, TRUTH.name, self._on_truth, newest(TRUTH))
        self._health = Health(self, f"{name_of(self, robot)}: camera")
        self.create_timer(HEALTH_S, self._report, clock=Clock(clock_type=ClockType.STEADY_TIME))
        if settings.lockstep:
            self._period = LockstepAnswer(
                self,
                {topic: name for name, topic in self._topics.items()},
                self._compute,
                [*self._images, self._infos],
                upstream=[node for node in settings.upstream if node],
                wait_for_subscribers=settings.wait_for_subscribers,
            )

    def destroy_node(self) -> None:
        """Free what the driver holds, once no callback comes any more."""
        if hasattr(self, "_renderer"):
            self._drawing.submit(self._renderer.close).result()
        if hasattr(self, "_drawing"):
            self._drawing.shutdown()
        super().destroy_node()

    def _on_truth(self, message: Odometry) -> None:
        self._take(TRUTH.name, message, message.pose.pose)

    def _on_block(self, name: str, message: PoseStamped) -> None:
        self._take(name, message, message.pose)

    def _take(self, name: str, message: Any, pose: Any) -> None:
        time_ns, p, q = stamp_ns(message.header.stamp), pose.position, pose.orientation
        numbers = np.array([p.x, p.y, p.z, q.x, q.y, q.z, q.w])
        if self._period is not None:
            self._period.add(self._topics[name], time_ns, (time_ns, numbers))
            return
        for publisher, made in self._seen(name, time_ns, numbers):
            publisher.publish(made)

    def _compute(self, _period_ns: int, readings: list[tuple[str, Any]]) -> list[tuple[Publisher, Any]]:
        ordered = sorted(readings, key=lambda reading: (reading[1][0], reading[0] == TRUTH.name))
        return [made for name, reading in ordered for made in self._seen(name, *reading)]

    def _seen(self, name: str, time_ns: int, pose: np.ndarray) -> list[tuple[Publisher, Any]]:
        """Images that are due with a new pose of the robot or of a block."""
        if not np.isfinite(pose).all() or attitude_problem(pose[3:]):
            return []  # a state that is none shows nothing
        if name != TRUTH.name:
            self._poses[name] = pose
            return []
        if not self._times.is_due(time_ns):
            return []
        began_s = time.perf_counter()
        frames = self._drawing.submit(self._renderer.render, pose, self._poses).result()
        images = image_messages(frames.rgb, frames.depth, frames.segmentation, self._frame, time_ns)
        self._info.header.stamp = images[0].header.stamp
        self._spent_s += time.perf_counter() - began_s
        return [*zip(self._images, images, strict=True), (self._infos, self._info)]

    def _report(self) -> None:
        made, missed = self._times.made, self._times.missed
        values = {"frames": str(made), "frames_missed": str(missed)}
        values["drawing_ms_mean"] = f"{1e3 * self._spent_s / max(1, made):.1f}"
        warnings = (
            ["the camera draws fewer images than its rate asks for, see frames_missed"] if missed else []
        )
        words = "drawing" if made else "waiting for the plant"
        self._health.publish("warn" if missed else "ok", words, values, warnings=warnings)


def main() -> None:
    """Run the node until it is stopped."""
    os.nice(BEHIND)  # nodes that control come first
    sys.exit(run_node(CameraNode))


if __name__ == "__main__":
    main()
