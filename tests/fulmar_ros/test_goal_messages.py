"""Goals and obstacles survive the wire, and what makes no sense is refused with a reason."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from geometry_msgs.msg import PoseArray, PoseStamped, TwistStamped
from nav_msgs.msg import Odometry
from visualization_msgs.msg import Marker, MarkerArray

from fulmar_bags.message_reader import (
    MOST_OBSTACLES,
    MOST_WAYPOINTS,
    goal_of,
    measurement_of,
    obstacles_of,
    stamp_ns,
)
from fulmar_core.states.planar import PlanarState
from fulmar_core.tasks.goal import goal_at
from fulmar_core.wires.robot_name import frames_of
from fulmar_ros.goal_messages import goal_message, obstacles_message

NAN = float("nan")
COURSE = ((1.0, -2.0, 0.5), (0.0, 3.0, -3.0), (4.0, 4.0, 0.0))


@pytest.mark.parametrize("topic", ["goal_pose", "goal_path", "goal_velocity"])
def test_a_goal_comes_back_as_it_was(topic):
    targets = COURSE if topic == "goal_path" else COURSE[:1]
    message = goal_message(goal_at(*targets), topic, 1_500_000_000)
    found, problem = goal_of(message)
    assert problem == ""
    np.testing.assert_allclose(PlanarState.targets_of(found), targets)
    assert stamp_ns(message.header.stamp) == 1_500_000_000


def test_a_point_has_no_heading():
    found, _ = goal_of(goal_message(goal_at(COURSE[0]), "goal_point", 0))
    assert found.tolist() == [[1.0, -2.0, 0.0, 0.0, 0.0, 0.0, 1.0]]
    assert PlanarState.targets_of(found).tolist() == [[1.0, -2.0, 0.0]]


def test_a_goal_is_received_in_six_degrees_of_freedom():
    pose = PoseStamped()
    pose.header.frame_id = "odom"
    p, q = pose.pose.position, pose.pose.orientation
    p.x, p.y, p.z, q.x, q.y, q.z, q.w = 1.0, 2.0, 3.0, 0.5, -0.5, 0.5, 0.5
    assert goal_of(pose)[0].tolist() == [[1.0, 2.0, 3.0, 0.5, -0.5, 0.5, 0.5]]
    twist = TwistStamped()
    twist.header.frame_id = "base_link"
    v, w = twist.twist.linear, twist.twist.angular
    v.x, v.y, v.z, w.x, w.y, w.z = 0.1, 0.2, 0.3, 0.4, 0.5, 0.6
    assert goal_of(twist)[0].tolist() == [[0.1, 0.2, 0.3, 0.4, 0.5, 0.6]]


def test_of_many_targets_a_point_is_the_one_that_counts():
    goal = goal_at(*COURSE)
    message = goal_message(replace(goal, done=np.asarray(1.0)), "goal_point", 0)
    assert (message.point.x, message.point.y) == (0.0, 3.0)


def spoilt(topic, spoil):
    message = goal_message(goal_at(*COURSE), topic, 0)
    spoil(message)
    return message


def in_map(message):
    message.header.frame_id = "map"


def nothing(message):
    message.poses = []


def endless(message):
    message.poses = message.poses[:1] * (MOST_WAYPOINTS + 1)


def nan_in_the_middle(message):
    message.poses[1].pose.position.y = NAN


def long_quaternion(message):
    message.poses[1].pose.orientation.w = 3.0


def nan_velocity(message):
    message.twist.angular.z = NAN


def nan_point(message):
    message.point.x = NAN


@pytest.mark.parametrize(
    ("topic", "spoil", "reason"),
    [
        ("goal_point", in_map, "goal frame is 'map', must be 'odom'"),
        ("goal_path", in_map, "goal frame is 'map', must be 'odom'"),
        ("goal_velocity", in_map, "goal frame is 'map', must be 'base_link'"),
        ("goal_path", nothing, "goal has 0 waypoints"),
        ("goal_path", endless, f"goal has {MOST_WAYPOINTS + 1} waypoints"),
        ("goal_path", nan_in_the_middle, "not finite"),
        ("goal_path", long_quaternion, "quaternion has norm"),
        ("goal_velocity", nan_velocity, "not finite"),
        ("goal_point", nan_point, "not finite"),
    ],
)
def test_a_goal_without_sense_is_refused_with_a_reason(topic, spoil, reason):
    goal, problem = goal_of(spoilt(topic, spoil))
    assert goal is None
    assert reason in problem


ALPHA = frames_of("alpha", "floating_platform")


@pytest.mark.parametrize("topic", ["goal_point", "goal_pose", "goal_path", "goal_velocity"])
def test_a_named_robot_takes_goals_with_its_prefix_and_without_and_no_others(topic):
    goal = goal_at((1.0, 2.0, 0.3))
    named, plain = goal_message(goal, topic, 7, ALPHA), goal_message(goal, topic, 7)
    assert named.header.frame_id == f"alpha/{plain.header.frame_id}"
    for message in (named, plain):
        assert goal_of(message, ALPHA)[1] == ""
    assert "goal frame is 'alpha/" in goal_of(named)[1]
    assert "goal frame is 'alpha/" in goal_of(named, frames_of("beta", "floating_platform"))[1]


def test_a_named_robot_takes_obstacles_and_odometry_with_its_prefix_and_without():
    discs = np.array([[1.0, 2.0, 0.3]])
    for message in (obstacles_message(discs, 7, ALPHA), obstacles_message(discs, 7)):
        assert obstacles_of(message, ALPHA)[1] == ""
    assert "'alpha/odom', must be 'odom'" in obstacles_of(obstacles_message(discs, 7, ALPHA))[1]
    for prefix in ("", "alpha/"):
        odometry = Odometry(child_frame_id=f"{prefix}base_link")
        odometry.header.frame_id = f"{prefix}odom"
        found = measurement_of(odometry, ALPHA)
        assert (found.frame, found.child_frame) == ("odom", "base_link")


def test_an_array_of_poses_is_the_same_goal_as_the_path_of_these_poses():
    path = goal_message(goal_at((1.0, 2.0, 0.3), (3.0, 4.0, -0.5)), "goal_path", 7)
    array = PoseArray(header=path.header, poses=[stamped.pose for stamped in path.poses])
    found, problem = goal_of(array)
    assert problem == ""
    np.testing.assert_array_equal(found, goal_of(path)[0])
    assert "0 waypoints" in goal_of(PoseArray(header=path.header))[1]
    array.header.frame_id = "map"
    assert "must be 'odom'" in goal_of(array)[1]


def test_obstacles_come_back_as_they_were_without_those_that_are_not_there():
    discs, problem = obstacles_of(obstacles_message(np.array([[1.0, 2.0, 0.3], [5.0, 5.0, 0.0]]), 7))
    assert problem == ""
    np.testing.assert_allclose(discs, [[1.0, 2.0, 0.3]])


def test_no_obstacles_are_reported_with_a_stamp_and_clear_a_viewer():
    message = obstacles_message(np.zeros((0, 3)), 7)
    assert [marker.action for marker in message.markers] == [Marker.DELETEALL]
    assert stamp_ns(message.markers[0].header.stamp) == 7
    discs, problem = obstacles_of(message)
    assert (len(discs), problem) == (0, "")


@pytest.mark.parametrize(
    ("x", "diameter", "frame", "reason"),
    [
        (NAN, 0.4, "odom", "not finite"),
        (0.0, NAN, "odom", "not finite"),
        (0.0, -0.4, "odom", "negative size"),
        (0.0, 0.4, "map", "obstacle frame is 'map', must be 'odom'"),
    ],
)
def test_an_obstacle_without_sense_is_refused_with_a_reason(x, diameter, frame, reason):
    message = obstacles_message(np.array([[1.0, 2.0, 0.3]]), 7)
    marker = message.markers[1]
    marker.pose.position.x, marker.scale.x, marker.header.frame_id = x, diameter, frame
    discs, problem = obstacles_of(message)
    assert discs is None
    assert reason in problem


def test_as_many_obstacles_as_are_taken_come_with_the_marker_that_clears_the_view():
    discs, problem = obstacles_of(obstacles_message(np.full((MOST_OBSTACLES, 3), 0.5), 7))
    assert problem == ""
    assert len(discs) == MOST_OBSTACLES
    one_more = obstacles_message(np.full((MOST_OBSTACLES + 1, 3), 0.5), 7)
    assert obstacles_of(one_more)[0] is None
    assert obstacles_of(MarkerArray(markers=one_more.markers[1:]))[0] is None


def test_a_frame_that_is_no_name_is_not_quoted_whole():
    long = "f" * 1_000_000
    goal, marks, odometry = (
        goal_message(goal_at((1.0, 2.0, 0.3)), "goal_pose", 7),
        obstacles_message(np.ones((1, 3)), 7),
        Odometry(),
    )
    goal.header.frame_id = marks.markers[1].header.frame_id = long
    odometry.header.frame_id = odometry.child_frame_id = long
    found = measurement_of(odometry)
    for reported in (goal_of(goal)[1], obstacles_of(marks)[1], found.frame, found.child_frame):
        assert "ffff" in reported
        assert len(reported) < 200


def test_an_absurd_number_of_obstacles_is_refused():
    discs, problem = obstacles_of(MarkerArray(markers=[Marker()] * (MOST_OBSTACLES + 1)))
    assert discs is None
    assert "obstacles, at most" in problem
