"""Robots that exist on the wires alone: what a bag holds of one is published as that of many, again and again.

`python -m fulmar_benchmarks.console.fleet BAG --robots 10`; the load under which the console's server is measured.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from nav_msgs.msg import Odometry
from sensor_msgs.msg import JointState
from std_msgs.msg import String

from fulmar_bags.run_record import read_run
from fulmar_core.loop.robot_info import RobotSetup, as_json, robot_info
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import ACTUATORS_STATE, DIAGNOSTICS, ODOMETRY, ROBOT_INFO
from fulmar_core.tasks import load_task
from fulmar_core.wires.robot_name import namespace_of
from fulmar_ros.convert import stamp_of
from fulmar_ros.qos import publisher_qos
from fulmar_ros.runtime import ros_node

RATE_HZ = 50.0
ROBOT, TASK = "floating_platform", "go_to_pose"
APART_M = 2.0


def publish(bag: Path, robots: int, seconds: float) -> None:
    """Publish for a time [s]."""
    run, robot = read_run(bag), load_robot(ROBOT)
    poses, commands = np.hstack((run.odom.position, run.odom.quat_xyzw)), run.applied.effort
    errors: list[Exception] = []
    with ros_node("fleet", errors.append) as node:
        diagnostics = node.create_publisher(DiagnosticArray, DIAGNOSTICS.name, publisher_qos(DIAGNOSTICS))
        spaces, infos = [namespace_of(f"robot_{number}") for number in range(robots)], []
        for number, space in enumerate(spaces):
            infos.append(
                node.create_publisher(String, f"{space}/{ROBOT_INFO.name}", publisher_qos(ROBOT_INFO))
            )
            setup = RobotSetup(name=f"robot_{number}", started_ns=time.time_ns())
            infos[-1].publish(String(data=as_json(robot_info(robot, load_task(TASK), setup))))
        odometry = [
            node.create_publisher(Odometry, f"{each}/odom", publisher_qos(ODOMETRY)) for each in spaces
        ]
        wire = ACTUATORS_STATE
        applied = [
            node.create_publisher(JointState, f"{each}/{wire.name}", publisher_qos(wire)) for each in spaces
        ]
        began_s, step = time.monotonic(), 0
        while time.monotonic() - began_s < seconds and not errors:
            for number in range(robots):
                odometry[number].publish(_odometry(poses[step % len(poses)], number, step))
                values = commands[step % len(commands)].tolist()
                applied[number].publish(JointState(name=list(robot.actuators.names), effort=values))
            if step % int(RATE_HZ) == 0:
                diagnostics.publish(_reports(robots))
            step += 1
            time.sleep(max(0.0, began_s + step / RATE_HZ - time.monotonic()))


def _odometry(pose: np.ndarray, number: int, step: int) -> Odometry:
    message = Odometry()
    message.header.stamp = stamp_of(round(1e9 * (1.0 + step / RATE_HZ)))
    p, q = message.pose.pose.position, message.pose.pose.orientation
    p.x, p.y, p.z, q.x, q.y, q.z, q.w = pose.tolist()
    p.y += APART_M * number
    return message


def _reports(robots: int) -> DiagnosticArray:
    values = [KeyValue(key=key, value=value) for key, value in (("mode", "running"), ("estop", "false"))]
    return DiagnosticArray(
        status=[
            DiagnosticStatus(
                level=DiagnosticStatus.OK, name=f"robot_{number}: plant", message="running", values=values
            )
            for number in range(robots)
        ]
    )


def main(argv: Sequence[str] | None = None) -> int:
    """Publish what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("bag", type=Path)
    parser.add_argument("--robots", type=int, default=10)
    parser.add_argument("--seconds", type=float, default=60.0)
    given = parser.parse_args(argv)
    publish(given.bag, given.robots, given.seconds)
    return 0


if __name__ == "__main__":
    sys.exit(main())
