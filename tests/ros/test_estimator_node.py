"""The estimator on the wires, and a robot that finds its goal by nothing but poses and inertial readings."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Odometry
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import Imu

from fulmar_core.config.errors import ConfigError
from fulmar_core.estimators.motion.frozen import POSE_FROZEN
from fulmar_core.robots.topics import IMU, MOCAP, ODOMETRY
from fulmar_ros.convert import PoseWriter, stamp_of
from fulmar_ros.estimator_node import EstimatorNode
from fulmar_ros.qos import publisher_qos, subscriber_qos
from fulmar_ros.runtime import spinning
from tests.conftest import RosDomain
from tests.ros.cli import json_of, run_in_real_time
from tests.ros.neighbour import NAMESPACE, Neighbour, second_publisher, until
from tests.states import planar_state

real_time = pytest.mark.real_time

pytest.importorskip("filterpy")
MS = 1_000_000


class Sources:
    """Motion capture and inertial unit in the test's hand."""

    def __init__(self, neighbour: Neighbour) -> None:
        node = neighbour.node
        self.neighbour = neighbour
        self.odometry: list[Odometry] = []
        self.poses = node.create_publisher(PoseStamped, MOCAP.name, publisher_qos(MOCAP))
        self.readings = node.create_publisher(Imu, IMU.name, publisher_qos(IMU))
        node.create_subscription(
            Odometry, ODOMETRY.name, self.odometry.append, subscriber_qos(ODOMETRY, reliable=True, depth=50)
        )
        self.now_ns = 1_000 * MS
        self.rng = np.random.default_rng(0)
        until(lambda: bool(self.poses.get_subscription_count() and self.readings.get_subscription_count()))

    def tick(
        self,
        *,
        pose: bool = True,
        x: float = 0.0,
        frame: str = "odom",
        bad: bool = False,
        frozen: bool = False,
    ) -> None:
        """20 ms of a robot at rest, measured with noise; a frozen motion capture has none."""
        self.now_ns += 20 * MS
        noise = 1e-4 * self.rng.standard_normal(8)
        reading = Imu()
        reading.header.stamp = stamp_of(self.now_ns)
        force, turn = reading.linear_acceleration, reading.angular_velocity
        force.x, force.y, force.z = noise[0], noise[1], float("nan") if bad else 9.81
        turn.x, turn.y, turn.z = noise[2:5].tolist()
        self.readings.publish(reading)
        if pose:
            off = np.zeros(3) if frozen else noise[5:]
            pose = PoseWriter().raw(planar_state(x + off[0], off[1], 0.5 + off[2]), self.now_ns)
            message = deserialize_message(pose, PoseStamped)
            message.header.frame_id = frame
            self.poses.publish(message)

    def until_odometry(self) -> None:
        count = len(self.odometry)
        until(lambda: self.tick() or len(self.odometry) > count + 3)  # type: ignore[func-returns-value]

    @property
    def said(self) -> tuple[str, dict[str, str]]:
        return self.neighbour.said.get("estimator", ("", {"last_refusal": ""}))


@pytest.fixture
def sources(neighbour: Neighbour, monkeypatch: pytest.MonkeyPatch) -> Iterator[Sources]:
    monkeypatch.setattr(sys, "argv", ["estimator_node"])
    node = EstimatorNode(lambda _code: None, cli_args=["--ros-args", "-r", f"__ns:={NAMESPACE}"])
    with spinning(node, lambda error: pytest.fail(repr(error))):
        yield Sources(neighbour)
        node.stop()


def test_a_node_that_is_started_by_hand_refuses_an_estimator_of_the_other_space(
    neighbour: Neighbour, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "argv", ["estimator_node"])
    given = ["--ros-args", "-p", "robot:=spacecraft_16", "-p", "estimator:=mocap_imu"]
    with pytest.raises(ConfigError, match="Use 'mocap_imu_3d' of configs/estimators"):
        EstimatorNode(lambda _code: None, cli_args=given)


@real_time
def test_odometry_has_frames_the_stamp_of_what_it_is_about_and_covariances(sources: Sources) -> None:
    sources.until_odometry()
    message = sources.odometry[-1]
    assert (message.header.frame_id, message.child_frame_id) == ("odom", "base_link")
    assert message.header.stamp.sec * 1000 * MS + message.header.stamp.nanosec <= sources.now_ns
    covariance = np.array(message.twist.covariance).reshape(6, 6)
    assert 0.0 < covariance[0, 0] < 0.15**2
    assert 0.0 < np.array(message.pose.covariance).reshape(6, 6)[5, 5] < 0.1
    assert abs(message.twist.twist.linear.x) < 0.2


@real_time
def test_a_frozen_motion_capture_makes_no_odometry_and_is_a_warning_by_name(sources: Sources) -> None:
    sources.until_odometry()

    def frozen() -> bool:
        sources.tick(frozen=True)
        time.sleep(0.01)
        return bool(sources.said[1].get("warnings")) and sources.said[1]["stale"] == "true"

    until(frozen)
    assert sources.said[0] == sources.said[1]["warnings"] == POSE_FROZEN
    count = len(sources.odometry)
    for _ in range(20):
        sources.tick(frozen=True)
        time.sleep(0.01)
    assert len(sources.odometry) == count
    sources.until_odometry()


@real_time
def test_readings_of_two_nodes_make_no_odometry_and_both_nodes_are_named_until_one_is_gone(
    sources: Sources, ros_domain: RosDomain
) -> None:
    """Poses; tests/fulmar_ros/test_writer_watch.py has the others."""
    sources.until_odometry()
    name = f"{NAMESPACE}/neighbour"
    words = f"2 nodes publish {MOCAP.name}, and only one may: {name}, {name}"

    def silent() -> bool:
        before = len(sources.odometry)
        for _ in range(10):
            sources.tick()
            time.sleep(0.01)
        return len(sources.odometry) == before

    with second_publisher(ros_domain.id, MOCAP):
        until(silent)
        until(lambda: silent() and sources.said[1].get("warnings", "").startswith(words))
        assert sources.said[0] == words
        assert sources.said[1]["last_refusal"].startswith(f"2 nodes publish {MOCAP.name}, and only one may: ")
        assert sources.said[1]["stale"] == "true"
    sources.until_odometry()


@real_time
def test_a_gap_is_bridged_and_then_silence_says_that_it_is_stale(sources: Sources) -> None:
    sources.until_odometry()
    last_pose_ns = sources.now_ns
    for _ in range(60):
        sources.tick(pose=False)
        time.sleep(0.005)
    until(lambda: "no believable pose" in sources.said[0])
    stamps = [m.header.stamp.sec * 1000 * MS + m.header.stamp.nanosec for m in sources.odometry]
    assert 100 * MS < max(stamps) - last_pose_ns <= 250 * MS
    sources.until_odometry()


@real_time
def test_senseless_messages_are_refused_and_reported(sources: Sources) -> None:
    sources.until_odometry()
    until(lambda: sources.tick(frame="camera") or "'camera'" in sources.said[1]["last_refusal"])  # type: ignore[func-returns-value]
    until(lambda: sources.tick(bad=True) or "not finite" in sources.said[1]["last_refusal"])  # type: ignore[func-returns-value]
    assert all(np.isfinite(m.twist.twist.linear.x) for m in sources.odometry)


@real_time
@pytest.mark.slow
def test_a_platform_reaches_its_pose_by_estimated_odometry_alone(
    ros_domain: RosDomain, tmp_path: Path
) -> None:
    """The loop over the estimator, in real time: plant, motion capture and inertial unit, estimator, policy."""
    asked = ("floating_platform", "--controller", "policy", "--start", "0.3,0.2,10", "--goal", "0,0,0")
    done = run_in_real_time(
        *asked, "--duration", "9", "--estimator", "mocap_imu", env=ros_domain.env, cwd=tmp_path
    )
    assert done.returncode == 0, done.stderr
    summary = json_of(done.stdout)
    assert summary["success"]
