"""The node `estimator`: poses of a motion capture and inertial readings to odometry."""

from __future__ import annotations

import sys
import threading
import time
from dataclasses import dataclass

import numpy as np
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Odometry
from rclpy.clock import Clock, ClockType
from rclpy.duration import Duration
from rclpy.node import Node
from sensor_msgs.msg import Imu

from fulmar_bags.message_reader import stamp_ns
from fulmar_core.errors import shortened
from fulmar_core.estimation.estimator import Estimate, Estimator
from fulmar_core.estimation.settings import load_estimator
from fulmar_core.process import CONTROL_PRIORITY, take_priority_with_helpers
from fulmar_core.robot import load_robot
from fulmar_core.sensors.imu import ImuSample
from fulmar_core.topics import IMU, MOCAP, ODOMETRY
from fulmar_ros.convert import OdometryWriter
from fulmar_ros.health import Health
from fulmar_ros.parameters import name_of, own_frames, read_parameters
from fulmar_ros.qos import LAST_WORDS_S, publisher_qos, subscriber_qos
from fulmar_ros.runtime import RequestExit, run_node

WATCH_S = 0.1
STATUS_PERIOD_S = 0.5
FRAMES = ("odom", "map", "world")  # names of the room in motion captures; all with Z up
BODY_AXES = np.ix_((0, 1, 5), (0, 1, 5))  # of a 6 × 6 covariance: x, y and yaw


@dataclass(frozen=True)
class EstimatorNodeSettings:
    """ROS parameters of the estimator node."""

    robot: str = "floating_platform"
    estimator: str = "mocap_imu"  # name of a file in configs/estimators, or a path that ends in .yaml


class EstimatorNode(Node):
    """Answers every pose and every inertial reading with the newest estimate, as long as it is not stale."""

    def __init__(self, _request_exit: RequestExit, *, cli_args: list[str] | None = None) -> None:
        """Begin without an estimate.

        Args:
            cli_args: ROS arguments of this node alone, where it shares a process.

        Raises:
            FulmarError: If a parameter or a file is wrong.
        """
        super().__init__("estimator", cli_args=cli_args)
        settings = read_parameters(self, EstimatorNodeSettings)
        robot = load_robot(settings.robot)
        believed = load_estimator(settings.estimator)
        self._estimator = Estimator(believed, robot.limits)
        self._bridge_s = believed.bridge_s
        self._lock = threading.Lock()
        self._frames = frames = own_frames(self, robot)
        self._writer = OdometryWriter(None, frame=frames.odom, child_frame=frames.base)
        self._published_ns = -1
        self._published, self._refused = 0, 0
        self._problem, self._refusal = self._estimator.problem, ""
        self._received_s = time.monotonic()
        self._prior = False
        self._said: tuple[object, ...] = ()
        self._said_s = 0.0
        self._publisher = self.create_publisher(Odometry, ODOMETRY.name, publisher_qos(ODOMETRY))
        self._health = Health(self, f"{name_of(self, robot)}: estimator")
        self.create_subscription(PoseStamped, MOCAP.name, self._on_pose, subscriber_qos(MOCAP, depth=5))
        # The readings drive the velocity: each counts.
        self.create_subscription(Imu, IMU.name, self._on_imu, subscriber_qos(IMU, reliable=True, depth=50))
        self.create_timer(WATCH_S, self._publish_status, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def _on_pose(self, message: PoseStamped) -> None:
        p, q = message.pose.position, message.pose.orientation
        frame = self._frames.plain(message.header.frame_id)
        with self._lock:
            if frame not in FRAMES:
                self._refuse(f"pose is in '{shortened(frame)}', must be in one of {', '.join(FRAMES)}")
                return
            self._take(
                self._estimator.see_pose(
                    np.array([p.x, p.y, p.z]), np.array([q.x, q.y, q.z, q.w]), stamp_ns(message.header.stamp)
                )
            )

    def _on_imu(self, message: Imu) -> None:
        if (
            message.linear_acceleration_covariance[0] == -1.0
            or message.angular_velocity_covariance[0] == -1.0
        ):
            return  # REP-145: marks fields that are absent
        a, w = message.linear_acceleration, message.angular_velocity
        sample = ImuSample(np.array([a.x, a.y, a.z]), np.array([w.x, w.y, w.z]))
        with self._lock:
            self._take(self._estimator.see_imu(sample, stamp_ns(message.header.stamp)))

    def _take(self, problem: str) -> None:
        """Publish the estimate, if it is newer than the last one; call with the lock held."""
        if not self._prior:
            take_priority_with_helpers(CONTROL_PRIORITY)  # a controller waits for us
            self._prior = True
        if problem:
            self._refuse(problem)
            return
        self._received_s = time.monotonic()
        estimate = self._estimator.estimate()
        self._problem = self._estimator.problem
        if estimate is not None and estimate.stamp_ns > self._published_ns:
            self._publish(estimate)
        elif estimate is not None and self._published_ns - estimate.stamp_ns > 1_000_000_000:
            self._publish(estimate)  # a new epoch, which began earlier

    def _publish(self, estimate: Estimate) -> None:
        message = self._writer.write(estimate.state, estimate.stamp_ns)
        pose, twist = np.zeros((6, 6)), np.zeros((6, 6))
        pose[BODY_AXES] = estimate.pose_covariance
        twist[BODY_AXES] = _in_body(estimate.motion_covariance, float(estimate.state.yaw))
        message.pose.covariance, message.twist.covariance = pose.ravel(), twist.ravel()
        self._publisher.publish(message)
        self._published_ns = estimate.stamp_ns
        self._published += 1

    def _refuse(self, reason: str) -> None:
        self._refused += 1
        self._refusal = reason

    def _publish_status(self) -> None:
        with self._lock:
            silent_s = time.monotonic() - self._received_s
            stale = f"nothing usable comes for {silent_s:.1f} s" if silent_s > self._bridge_s else ""
            problem = self._problem or stale
            key = (problem[:16], self._estimator.epoch, self._refused > 0)
            if key == self._said and time.monotonic() - self._said_s < STATUS_PERIOD_S:
                return
            self._said, self._said_s = key, time.monotonic()
            values = {
                "published": str(self._published),
                "outliers": str(self._estimator.outliers),
                "refused": str(self._refused),
                "last_refusal": self._refusal,
                "epoch": str(self._estimator.epoch),
                "stale": str(bool(problem)).lower(),
            }
        self._health.publish("warn" if problem else "ok", problem or "estimating", values)

    def stop(self) -> None:
        """Wait for the last odometry to arrive; nodes that receive none stop by themselves."""
        self._publisher.wait_for_all_acked(Duration(seconds=LAST_WORDS_S))


def _in_body(covariance: np.ndarray, yaw: float) -> np.ndarray:
    """Covariance of velocity and turn rate in the body's axes, from that in the world's, shapes (3, 3)."""
    c, s = np.cos(yaw), np.sin(yaw)
    turn = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    turned: np.ndarray = turn @ covariance @ turn.T
    return turned


def main() -> None:
    """Run the node until it is stopped."""
    sys.exit(run_node(EstimatorNode))


if __name__ == "__main__":
    main()
