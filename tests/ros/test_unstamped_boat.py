"""A boat whose commands carry no stamp: its propellers slew by the plant's own time at every rate."""

from __future__ import annotations

import logging
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from tests.conftest import RosDomain
from tests.ros.cli import fulmar, json_of

pytestmark = [pytest.mark.slow, pytest.mark.real_time]
GOALS = [[2.0, 0.5], [3.5, 2.0], [4.0, 4.0], [3.5, 6.0]]
STEER = """
import math
import rclpy
from nav_msgs.msg import Odometry, Path
from rclpy.node import Node
from sensor_msgs.msg import JointState

class Steer(Node):
    def __init__(self):
        super().__init__("steer", namespace="kingfisher")
        self.targets = []
        self.create_subscription(Path, "goal_path", self.on_path, 10)
        self.create_subscription(Odometry, "odom", self.on_odom, 10)
        self.commands = self.create_publisher(JointState, "actuators/command", 10)

    def on_path(self, message):
        self.targets = [pose.pose.position for pose in message.poses]

    def on_odom(self, message):
        place, q, twist = message.pose.pose.position, message.pose.pose.orientation, message.twist.twist
        while self.targets and math.hypot(self.targets[0].x - place.x, self.targets[0].y - place.y) < 0.25:
            del self.targets[0]
        target = self.targets[0] if self.targets else place
        bearing = math.atan2(target.y - place.y, target.x - place.x) - 2.0 * math.atan2(q.z, q.w)
        ahead_n = 8.0 * bool(self.targets) * max(0.0, math.cos(bearing)) ** 4
        off = math.sin(math.remainder(bearing, 2.0 * math.pi) / 2.0)
        turn_n = 16.0 * bool(self.targets) * off - 4.0 * twist.angular.z
        forces_n = [ahead_n - turn_n, ahead_n + turn_n]  # 19.5 N ahead and 4 N astern for each
        effort = [max(-1.0, min(1.0, force / (19.5 if force > 0.0 else 4.0))) for force in forces_n]
        command = JointState(name=["left", "right"], effort=effort)
        if STAMPED:
            command.header.stamp = message.header.stamp
        self.commands.publish(command)

rclpy.init()
rclpy.spin(Steer())
"""


@pytest.mark.parametrize("rate", [1, 2, 4])
@pytest.mark.parametrize("stamped", [True, False], ids=["with stamps", "without stamps"])
def test_a_boat_reaches_as_many_goals_at_every_rate(
    stamped: bool, rate: int, seed_of_series: int, ros_domain: RosDomain, tmp_path: Path
) -> None:
    (tmp_path / "steer.py").write_text(STEER.replace("STAMPED", str(stamped)))
    goals = {"kind": "positions", "title": "four corners", "positions": GOALS}
    (tmp_path / "corners.yaml").write_text(yaml.safe_dump(goals))
    steer = subprocess.Popen([sys.executable, "steer.py"], cwd=tmp_path, env=ros_domain.env)
    try:
        done = fulmar(
            "run", "kingfisher", "--task", "go_through_positions", "--controller", "external",
            "--goals", "corners.yaml",
            "--start=0,0,0", "--duration", "90", "--rate", str(rate), "--control-hz", "50",
            "--seed", str(seed_of_series), "--json", env=ros_domain.env, cwd=tmp_path, timeout_s=150.0,
        )  # fmt: skip
    finally:
        steer.terminate()
        steer.wait()
    summary = json_of(done.stdout)
    logging.info(summary["goals_progress"])
    assert summary["failure"] is None, done.stderr
    assert summary["goals_progress"] == "4 of 4 targets reached"
