"""Estimates as messages."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
from geometry_msgs.msg import InertiaStamped, TwistWithCovarianceStamped
from nav_msgs.msg import Odometry
from rclpy.serialization import deserialize_message

from fulmar_core.estimators.motion.estimator import Estimate
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import INERTIA, ODOMETRY, RATE
from fulmar_core.states.rotation import rotate_inverse
from fulmar_core.states.state import RigidBodyState
from fulmar_core.wires.robot_name import Frames
from fulmar_ros.estimator_node import EstimatorNode, _is_lacking
from fulmar_ros.estimator_wires import WRITERS

FRAMES = Frames("alpha/")
DRAW = np.random.default_rng(5)


def message_of(wire, value, covariance=None):
    kind, writer = WRITERS[wire]
    message = deserialize_message(writer(FRAMES)(Estimate(value, covariance, 7_000_000_009)), kind)
    assert (message.header.stamp.sec, message.header.stamp.nanosec) == (7, 9)
    return message


def spread(count):
    root = DRAW.normal(size=(count, count))
    return root @ root.T


def test_odometry_has_pose_twist_and_both_covariances_in_its_frames():
    place, velocity, rate = DRAW.normal(size=(3, 3))
    state = RigidBodyState(place, np.array([0.0, 0.6, 0.0, 0.8]), velocity, rate)
    covariance = spread(12)
    message: Odometry = message_of(ODOMETRY, state, covariance)
    assert (message.header.frame_id, message.child_frame_id) == ("alpha/odom", "alpha/base_link")
    assert message.pose.pose.position.y == state.position_in_world[1]
    assert message.pose.pose.orientation.w == 0.8
    ahead = message.twist.twist.linear
    np.testing.assert_allclose((ahead.x, ahead.y, ahead.z), rotate_inverse(state.quat_xyzw, velocity))
    assert message.twist.twist.angular.z == state.angular_velocity_in_body[2]
    np.testing.assert_array_equal(message.pose.covariance, covariance[:6, :6].ravel())
    np.testing.assert_array_equal(message.twist.covariance.reshape(6, 6)[3:, 3:], covariance[9:, 9:])


def test_a_rate_says_that_the_velocity_is_not_known():
    rate, covariance = DRAW.normal(size=3), spread(3)
    message: TwistWithCovarianceStamped = message_of(RATE, rate, covariance)
    assert message.twist.twist.angular.y == rate[1]
    assert message.twist.covariance[0] == -1.0
    np.testing.assert_array_equal(message.twist.covariance.reshape(6, 6)[3:, 3:], covariance)


def test_an_inertia_has_its_six_entries_in_their_places():
    tensor = spread(3)
    its = message_of(INERTIA, tensor).inertia
    found = [[its.ixx, its.ixy, its.ixz], [its.ixy, its.iyy, its.iyz], [its.ixz, its.iyz, its.izz]]
    np.testing.assert_array_equal(found, tensor)
    assert InertiaStamped().inertia.m == its.m


def test_what_a_controller_waits_for_goes_out_before_the_transform():
    estimate = Estimate("state", None, 5)
    transform = SimpleNamespace(publisher="tf", message=lambda value, stamp_ns: (value, stamp_ns))
    node = SimpleNamespace(_outputs=[("odom", lambda it: it.stamp_ns)], _transform=transform)
    assert EstimatorNode._messages(node, estimate) == [("odom", 5), ("tf", ("state", 5))]
    node._transform = None
    assert EstimatorNode._messages(node, estimate) == [("odom", 5)]


def test_an_estimator_waits_for_no_sensor_that_the_robot_lacks():
    names = ("imu", "mocap", "star_tracker", "wheels", "rate")
    lacking = {
        robot: [name for name in names if _is_lacking(name, load_robot(robot))]
        for robot in ("spacecraft_16", "cubesat_wheels")
    }
    assert lacking == {"spacecraft_16": ["star_tracker", "wheels"], "cubesat_wheels": []}
