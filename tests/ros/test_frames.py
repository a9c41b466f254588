"""The model and the frames of a robot, as RViz, Foxglove and tf2 receive them."""

from __future__ import annotations

import numpy as np
import pytest
from geometry_msgs.msg import TransformStamped
from nav_msgs.msg import Odometry
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

from fulmar_bags.contents import open_bag
from fulmar_bags.decode import NS, messages, stamps_ns
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import DESCRIPTION, ODOMETRY, ORIGIN, STATIC_TRANSFORMS, TRANSFORMS, TRUTH
from fulmar_core.robots.urdf import body_frames, urdf_of
from fulmar_core.wires.robot_name import frames_of
from fulmar_ros.plant_node import PlantNode
from fulmar_ros.qos import subscriber_qos
from fulmar_ros.runtime import spinning
from sim_nodes.sim_node import make_backend
from tests.ros.cli import fulmar, start_fulmar
from tests.ros.neighbour import NAMESPACE, ROBOT, until

# As tf2_ros and RViz subscribe (geometry2, transform_listener.h; rviz_default_plugins, RobotModel).
LATCHED = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
# Of tf2_msgs/msg/TFMessage on Jazzy, as `ros2 topic info --verbose /tf` shows it there.
JAZZY = "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087"
# Hides tf2_msgs from every process that has this module on its path.
HIDING = """
import sys
class Hide:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] == "tf2_msgs":
            raise ModuleNotFoundError("No module named 'tf2_msgs'", name=name)
sys.meta_path.insert(0, Hide())
"""


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


def test_a_robot_with_an_origin_begins_there_in_the_frame_that_all_robots_share(neighbour):
    arguments = [
        "--ros-args",
        "-r",
        f"__ns:={NAMESPACE}",
        "-p",
        "backend:=mock",
        "-p",
        "origin:=[2.0, -1.0, 90.0]",
    ]
    begins, fixed, truths = [], [], []
    subscribe = neighbour.node.create_subscription
    subscribe(TransformStamped, f"{NAMESPACE}/{ORIGIN.name}", begins.append, LATCHED)
    subscribe(TFMessage, STATIC_TRANSFORMS.name, fixed.append, LATCHED)
    subscribe(Odometry, f"{NAMESPACE}/{TRUTH.name}", truths.append, 10)
    node = PlantNode(make_backend, lambda _code: None, cli_args=arguments)
    with spinning(node, lambda error: pytest.fail(repr(error))):
        until(lambda: begins and fixed and truths)
        node.stop()
    (begin,) = begins
    assert (begin.header.frame_id, begin.child_frame_id) == ("map", "odom")
    p, q = begin.transform.translation, begin.transform.rotation
    np.testing.assert_allclose(
        (p.x, p.y, p.z, q.x, q.y, q.z, q.w), (2.0, -1.0, 0.0, 0.0, 0.0, 0.5**0.5, 0.5**0.5)
    )
    assert begin in fixed[0].transforms
    assert truths[0].header.frame_id == "odom"  # it is not turned into the shared frame


def test_transforms_have_the_type_of_a_jazzy_machine(neighbour, plant):
    until(lambda: bool(neighbour.node.get_publishers_info_by_topic(TRANSFORMS.name)))
    (found,) = neighbour.node.get_publishers_info_by_topic(TRANSFORMS.name)
    assert str(found.topic_type_hash) == JAZZY


def test_a_plant_leaves_the_transforms_to_another_node(neighbour):
    arguments = ["--ros-args", "-r", f"__ns:={NAMESPACE}", "-p", "backend:=mock", "-p", "transforms:=false"]
    node = PlantNode(make_backend, lambda _code: None, cli_args=arguments)
    with spinning(node, lambda error: pytest.fail(repr(error))):
        until(lambda: bool(neighbour.applied))
        offered = {name for name, _ in node.get_publisher_names_and_types_by_node("plant", NAMESPACE)}
        node.stop()
    assert f"{NAMESPACE}/{DESCRIPTION.name}" in offered
    assert not offered & {TRANSFORMS.name, STATIC_TRANSFORMS.name}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "more"),
    [
        ("floating_platform", ()),
        ("floating_platform", ("--estimator", "mocap_imu")),
        ("alpha", ("--name", "alpha")),
    ],
    ids=["plain", "with an estimator", "named"],
)
def test_listeners_of_a_running_system_get_model_and_frames(neighbour, name, more, ros_domain, tmp_path):
    frames, models, fixed, moving = frames_of(name, ROBOT), [], [], []
    node = neighbour.node
    node.create_subscription(String, f"/{name}/{DESCRIPTION.name}", models.append, LATCHED)
    node.create_subscription(TFMessage, STATIC_TRANSFORMS.name, fixed.append, LATCHED)
    node.create_subscription(TFMessage, TRANSFORMS.name, moving.append, 100)
    asked = ("--controller", "lqr", "--goal", "0.5,0,0", "--duration", "60", "--record", "bag")
    run = start_fulmar("run", ROBOT, *asked, *more, env=ros_domain.env, cwd=tmp_path)
    try:
        until(lambda: models and fixed and len(moving) > 20, timeout_s=40.0)
    finally:
        run.terminate()
        run.wait(30.0)
    assert models[0].data == urdf_of(load_robot(ROBOT), frames)
    assert ("map", frames.odom) in {(t.header.frame_id, t.child_frame_id) for t in fixed[0].transforms}
    pairs = {(t.header.frame_id, t.child_frame_id) for message in moving for t in message.transforms}
    assert pairs == {(frames.odom, frames.base)}


@pytest.mark.slow
def test_without_tf2_msgs_everything_else_runs_and_reads(ros_domain, tmp_path):
    (tmp_path / "sitecustomize.py").write_text(HIDING)
    hidden = ros_domain.env | {"PYTHONPATH": str(tmp_path)}
    asked = ("run", ROBOT, "--controller", "lqr", "--goal", "0.5,0,0", "--duration", "3", "--lockstep")
    plain = fulmar(*asked, "--record", "plain", env=hidden, cwd=tmp_path)
    assert "tf2" not in plain.stdout + plain.stderr
    topics = {topic.name for topic in open_bag(tmp_path / "plain").topics.values()}
    assert f"{NAMESPACE}/{DESCRIPTION.name}" in topics
    assert TRANSFORMS.name not in topics
    fulmar(*asked, "--record", "full", env=ros_domain.env, cwd=tmp_path)
    export = fulmar("bag", "export", "full", "--out", "csv", env=hidden, cwd=tmp_path)
    assert export.returncode == 0, export.stderr
    info = fulmar("bag", "info", "full", env=hidden, cwd=tmp_path)
    assert TRANSFORMS.name in info.stdout


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
    received = [message.transforms for _, message in messages(bag.of(TRANSFORMS))]
    transforms = [each for message in received for each in message]
    stamps = [each.header.stamp.sec * NS + each.header.stamp.nanosec for each in transforms]
    np.testing.assert_array_equal(stamps, stamps_ns(bag.of(ODOMETRY)))
    assert {each.child_frame_id for each in transforms} == {frames.base}
    assert {len(message) for message in received} == {1}


@pytest.mark.slow
def test_two_runs_in_lock_step_have_the_same_transforms(ros_domain, tmp_path):
    asked = ("--controller", "lqr", "--goal", "0.5,0,0", "--duration", "3", "--lockstep", "--seed", "3")
    for bag in ("one", "other"):
        fulmar("run", ROBOT, *asked, "--record", bag, env=ros_domain.env, cwd=tmp_path)
    one, other = (open_bag(tmp_path / bag).of(TRANSFORMS).data for bag in ("one", "other"))
    assert list(map(bytes, one)) == list(map(bytes, other))
    assert fulmar("bag", "diff", "one", "other", env=ros_domain.env, cwd=tmp_path).returncode == 0
