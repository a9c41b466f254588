"""Markers of a running system, as a viewer with RViz's default quality of service receives them."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest
import yaml
from rclpy.qos import QoSProfile
from visualization_msgs.msg import Marker, MarkerArray

from fulmar_bags.run_record import read_run
from fulmar_core.config.errors import DONE
from fulmar_core.robots.topics import MARKERS
from fulmar_core.tasks.goal import goal_at
from fulmar_ros.goal_messages import goal_message
from tests.conftest import RosDomain
from tests.ros.cli import child_running, start_fulmar
from tests.ros.neighbour import NAMESPACE, Neighbour, until

RVIZ = QoSProfile(depth=100)  # reliable and volatile


class Viewer:
    """Draws as RViz does: adds, replaces and deletes by namespace and number."""

    def __init__(self, neighbour: Neighbour) -> None:
        self.drawn: dict[tuple[str, int], Marker] = {}
        self.deleted: set[tuple[str, int]] = set()
        neighbour.node.create_subscription(MarkerArray, MARKERS.name, self._receive, RVIZ)

    def _receive(self, message: MarkerArray) -> None:
        for marker in message.markers:
            key = (marker.ns, marker.id)
            if marker.action == Marker.ADD:
                self.drawn[key] = marker
            elif marker.action == Marker.DELETE and self.drawn.pop(key, None) is not None:
                self.deleted.add(key)

    @property
    def groups(self) -> set[str]:
        return {group for group, _ in dict(self.drawn)}

    def goal_x(self) -> float | None:
        goal = self.drawn.get(("goal", 0))
        return None if goal is None else goal.pose.position.x


@pytest.fixture
def up(neighbour: Neighbour, ros_domain: RosDomain, tmp_path: Path) -> Iterator[psutil.Popen]:
    """`fulmar up` of the platform, once its markers are drawn."""
    neighbour.withdraw_command()
    started = start_fulmar("up", "mock_lqr", "--json", "--record", "bag", env=ros_domain.env, cwd=tmp_path)
    until(lambda: neighbour.said["markers"][0] == "drawing", 30.0)
    yield started
    if started.poll() is None:
        started.kill()


@pytest.mark.slow
@pytest.mark.real_time
def test_a_viewer_sees_goal_geofence_and_thrust_and_a_system_outlives_the_node_that_draws(
    neighbour: Neighbour, up: psutil.Popen, tmp_path: Path
) -> None:
    neighbour.give_goal()  # far away
    until(lambda: bool(neighbour.applied) and neighbour.applied[-1].any(), 10.0)
    viewer = Viewer(neighbour)  # it comes after the goal
    until(lambda: {"body", "goal", "geofence", "thrust"} <= viewer.groups, 10.0)
    first = viewer.goal_x()
    assert {m.header.frame_id for k, m in viewer.drawn.items() if k[0] in ("goal", "geofence")} == {"odom"}
    assert {m.header.frame_id for k, m in viewer.drawn.items() if k[0] in ("body", "thrust")} == {"base_link"}
    assert all((m.header.stamp.sec, m.header.stamp.nanosec) == (0, 0) for m in viewer.drawn.values())
    moved = give_another(neighbour, first)
    until(lambda: viewer.goal_x() == pytest.approx(moved), 10.0)
    until(lambda: bool(viewer.deleted), 10.0)  # a valve that closed
    assert all(group == "thrust" for group, _ in viewer.deleted)

    child_running(up, "fulmar_ros.markers_node").kill()
    before = len(neighbour.applied)
    until(lambda: len(neighbour.applied) > before + 50, 10.0)
    assert up.poll() is None
    up.send_signal(signal.SIGTERM)
    _, errors = up.communicate(timeout=20.0)
    assert up.returncode == DONE
    assert errors.count("markers was killed by SIGKILL; it is started again, and the robot goes on") == 1
    assert not read_run(tmp_path / "bag").warnings
    assert f"{NAMESPACE}/{MARKERS.name}" in topics_with_messages(tmp_path / "bag")


def give_another(neighbour: Neighbour, first: float | None) -> float:
    """Give another goal, and say where."""
    assert first is not None
    place = first - 1.0
    neighbour.goal_publisher.publish(
        goal_message(goal_at((place, 0.0, 0.0)), "goal_pose", neighbour.node.get_clock().now().nanoseconds)
    )
    return place


def topics_with_messages(bag: Path) -> set[str]:
    found = yaml.safe_load((bag / "metadata.yaml").read_text(encoding="utf-8"))
    counts = found["rosbag2_bagfile_information"]["topics_with_message_count"]
    return {each["topic_metadata"]["name"] for each in counts if each["message_count"]}
