"""The model and the frames of a robot, as RViz, Foxglove and tf2 receive them."""

from __future__ import annotations

import numpy as np
import pytest
from nav_msgs.msg import Odometry
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

from fulmar_bags.contents import open_bag
from fulmar_bags.decode import messages, stamps_ns
from fulmar_core.robot import load_robot
from fulmar_core.robot_name import frames_of
from fulmar_core.topics import DESCRIPTION, ODOMETRY, STATIC_TRANSFORMS, TRANSFORMS
from fulmar_core.urdf import body_frames, urdf_of
from fulmar_ros.qos import subscriber_qos
from tests.ros.cli import fulmar
from tests.ros.neighbour import NAMESPACE, ROBOT, until

# As tf2_ros and RViz subscribe (geometry2, transform_listener.h; rviz_default_plugins, RobotModel).
LATCHED = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def test_tf_has_the_pose_of_each_odometry(neighbour, plant):
    places, transforms = {}, {}

    def keep_odometry(message):
        p, q = message.pose.pose.position, message.pose.pose.orientation
        places[message.header.stamp.sec, message.header.stamp.nanosec] = (p.x, p.y, p.z, q.x, q.y, q.z, q.w)

    def keep_transform(message):
        (each,) = message.transforms
        assert (each.header.frame_id, each.child_frame_id) == ("odom", "base_link")
        p, q = each.transform.translation, each.transform.rotation
        transforms[each.header.stamp.sec, each.header.stamp.nanosec] = (p.x, p.y, p.z, q.x, q.y, q.z, q.w)

    neighbour.node.create_subscription(
        Odometry, f"{NAMESPACE}/{ODOMETRY.name}", keep_odometry, subscriber_qos(ODOMETRY)
    )
    neighbour.node.create_subscription(TFMessage, TRANSFORMS.name, keep_transform, 100)
    until(lambda: len(set(places) & set(transforms)) >= 10)
    for stamp in set(places) & set(transforms):
        np.testing.assert_array_equal(places[stamp], transforms[stamp])


def test_late_subscribers_get_the_model_and_its_fixed_frames(neighbour, plant):
    models, fixed = [], []
    neighbour.node.create_subscription(String, f"{NAMESPACE}/{DESCRIPTION.name}", models.append, LATCHED)
    neighbour.node.create_subscription(TFMessage, STATIC_TRANSFORMS.name, fixed.append, LATCHED)
    until(lambda: models and fixed)
    robot = load_robot(ROBOT)
    assert models[0].data == urdf_of(robot)
    found = {(each.header.frame_id, each.child_frame_id) for each in fixed[0].transforms}
    assert found == {("map", "odom"), *(("base_link", frame.name) for frame in body_frames(robot))}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("robot", "more"),
    [("turtlebot2", ("--name", "alpha")), ("floating_platform", ("--estimator", "mocap_imu"))],
    ids=["named", "with an estimator"],
)
def test_a_bag_has_the_model_and_the_frames(robot, more, ros_domain, tmp_path):
    asked = ("--controller", "classical", "--goal", "0.5,0,0", "--duration", "3", "--lockstep")
    fulmar("run", robot, *asked, *more, "--record", "bag", env=ros_domain.env, cwd=tmp_path)
    bag = open_bag(tmp_path / "bag")
    frames = frames_of(bag.name, robot)
    (_, model), *_ = messages(bag.of(DESCRIPTION))
    assert model.data == urdf_of(load_robot(robot), frames)
    (_, fixed), *_ = messages(bag.of(STATIC_TRANSFORMS))
    assert ("map", frames.odom) in {(t.header.frame_id, t.child_frame_id) for t in fixed.transforms}
    np.testing.assert_array_equal(stamps_ns(bag.of(TRANSFORMS)), stamps_ns(bag.of(ODOMETRY)))
    _, last = messages(bag.of(TRANSFORMS))[-1]
    assert last.transforms[0].child_frame_id == frames.base
