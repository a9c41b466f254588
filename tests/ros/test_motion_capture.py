"""A simulated motion capture on the wires: at its own rate beside the odometry, and under a name of the laboratory."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest
import rclpy
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Odometry
from rclpy.qos import QoSProfile, ReliabilityPolicy, qos_profile_sensor_data

from fulmar_bags.contents import open_bag
from fulmar_bags.message_reader import stamp_ns
from fulmar_bags.tables import rows
from fulmar_core.robots.topics import MOCAP, ODOMETRY
from fulmar_ros.plant_node import PlantNode
from fulmar_ros.runtime import spinning
from sim_nodes.sim_node import make_backend
from tests.conftest import RosDomain
from tests.ros.cli import json_of, start_fulmar
from tests.ros.neighbour import NAMESPACE, Neighbour, until

pytestmark = pytest.mark.real_time
NAME = "/vrpn_mocap/body/pose"


def test_poses_come_at_200_hz_beside_odometry_at_50_hz(neighbour: Neighbour) -> None:
    poses: list[PoseStamped] = []
    odometry: list[Odometry] = []
    neighbour.node.create_subscription(PoseStamped, MOCAP.name, poses.append, qos_profile_sensor_data)
    neighbour.node.create_subscription(Odometry, ODOMETRY.name, odometry.append, qos_profile_sensor_data)
    arguments = ["--ros-args", "-r", f"__ns:={NAMESPACE}", "-p", "backend:=mock", "-p", "mocap_hz:=200.0"]
    node = PlantNode(make_backend, lambda _code: None, cli_args=arguments)
    with spinning(node, lambda error: pytest.fail(repr(error))):
        until(lambda: len(poses) > 150)
        node.stop()
    stamps = np.array([stamp_ns(message.header.stamp) for message in poses[50:150]]) / 1e9
    assert (np.diff(stamps) > 0.0).all()
    assert np.median(np.diff(stamps)) == pytest.approx(0.005, abs=0.001)
    measured = np.array([stamp_ns(message.header.stamp) for message in odometry]) / 1e9
    assert np.median(np.diff(measured)) == pytest.approx(0.02, abs=0.001)


@pytest.mark.slow
def test_a_run_with_a_remapped_motion_capture_estimates_from_it_and_records_it(
    ros_domain: RosDomain, tmp_path: Path
) -> None:
    """Plant, estimator and recorder agree on the name; the bag keeps the one that reports know.

    In lock step, where a machine under load loses nothing and no watchdog trips.
    """
    pytest.importorskip("filterpy")
    poses: list[PoseStamped] = []
    context = rclpy.Context()
    rclpy.init(args=[], context=context, domain_id=ros_domain.id)
    node = rclpy.create_node("laboratory", context=context)
    patient = QoSProfile(depth=1000, reliability=ReliabilityPolicy.BEST_EFFORT)  # receives under load, too
    node.create_subscription(PoseStamped, NAME, poses.append, patient)
    asked = ("floating_platform", "--controller", "lqr", "--start", "0.2,0.1,5", "--goal", "0,0,0")
    run = start_fulmar(
        *("run", *asked, "--duration", "20", "--lockstep", "--estimator", "mocap_imu", "--mocap-hz", "100"),
        *("--remap", f"mocap/pose:={NAME}", "--record", "bag", "--json"),
        env=ros_domain.env,
        cwd=tmp_path,
    )
    executor = rclpy.executors.SingleThreadedExecutor(context=context)
    executor.add_node(node)
    try:
        began = time.monotonic()
        while run.poll() is None and time.monotonic() - began < 60.0:
            executor.spin_once(timeout_sec=0.05)
        output, errors = run.communicate(timeout=20.0)
    finally:
        if run.poll() is None:
            run.kill()
        executor.shutdown()
        node.destroy_node()
        rclpy.shutdown(context=context)
    summary = json_of(output)
    assert summary["failure"] is None, errors
    assert summary["steps"] > 90
    topics = open_bag(tmp_path / "bag").topics
    received = {stamp_ns(message.header.stamp) for message in poses}
    _, recorded, _ = rows(topics["/floating_platform/mocap/pose"])
    assert len(recorded) > 1900
    assert set(np.diff(recorded)) == {10_000_000}
    assert len(received) > 100
    assert received <= set(recorded)
    assert len(topics["/floating_platform/odom"]) == summary["steps"]
    assert NAME not in topics
