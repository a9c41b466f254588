"""The system that a fault is done to, and the relay that changes messages on their way."""

from __future__ import annotations

import shutil
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import yaml
from geometry_msgs.msg import PoseStamped, TwistStamped
from nav_msgs.msg import Odometry
from rclpy.node import Node
from sensor_msgs.msg import JointState

from fulmar_bringup.planning import RunRequest, plan_run
from fulmar_core.topics import COMMAND, MOCAP, ODOMETRY, VELOCITY_COMMAND, Wire
from fulmar_ros.qos import publisher_qos, subscriber_qos
from policy_server.controllers import shipped_policy

KINDS = {ODOMETRY: Odometry, MOCAP: PoseStamped, COMMAND: JointState, VELOCITY_COMMAND: TwistStamped}
Injection = Callable[[Any], Any]  # a message to what is passed on in its place, or to None


def source_of(wire: Wire) -> str:
    """Where messages of a wire come from before they are passed on."""
    return f"original/{wire.name}"


def unchanged(message: Any) -> Any:
    """As it came."""
    return message


def lost(_message: Any) -> None:
    """Nothing passes."""


def delayed(periods: int) -> Injection:
    """Everything comes later, by so many messages."""
    waiting: deque[Any] = deque()

    def change(message: Any) -> Any:
        waiting.append(message)
        return waiting.popleft() if len(waiting) > periods else None

    return change


class FaultInjector:
    """Passes messages on; `change` changes each, or swallows it by returning None."""

    def __init__(self, node: Node, wire: Wire) -> None:
        """Begin as if it were not there."""
        self.change: Injection = unchanged
        kind, reliable = KINDS[wire], wire.delivery != "best_effort"
        self._publisher = node.create_publisher(kind, wire.name, publisher_qos(wire))
        node.create_subscription(
            kind, source_of(wire), self._pass, subscriber_qos(wire, reliable=reliable, depth=10)
        )

    def _pass(self, message: Any) -> None:
        changed = self.change(message)
        if changed is not None:
            self._publisher.publish(changed)


FAR_M = 6.0  # the robot is under way for seconds
CORNERS_M = ((FAR_M, 0.0), (FAR_M, 1.0))  # where a node of goals sends it


@dataclass(frozen=True)
class FaultEnvironment:
    """What is unusual about a system; the usual one has an e-stop, and its odometry may be intercepted."""

    guards: Mapping[str, Any] = field(default_factory=dict)  # beside the e-stop
    # The wire that passes through the injector; None: the robot's commands.
    intercepted: Wire | None = ODOMETRY
    answers_pass: bool = False  # the robot's commands, too, pass through an injector of their own
    by_goal_node: bool = False  # a goal node publishes goals from a file
    by_hand: bool = False  # a node for teleoperation runs, and nobody touches it yet
    scenario: str = "nominal"
    emulated: bool = False  # a driver drives an emulated device
    two_hosts: bool = False  # the controller is on another one
    bundle: Callable[[Path], None] | None = None  # what is done to the bundle before the start


USUAL = FaultEnvironment()


def request_of(robot: str, record: Path, about: FaultEnvironment = USUAL) -> RunRequest:
    """A robot that has far to go, with an e-stop.

    Args:
        robot: Its name.
        record: Folder of the bag; files that are needed are made beside it.
        about: What is unusual.
    """
    task = "go_to_pose" if shipped_policy(robot, "go_to_pose") else "go_to_position"
    request = plan_run(
        robot=robot,
        task=task,
        controller="policy",
        backend="hardware" if about.emulated else "mujoco",
        policy=None,
        goal=None if about.by_goal_node else (FAR_M, 0.0, 0.0),
        start=(0.0, 0.0, 0.0),
        duration_s=None,
        lockstep=False,
        rate=1.0,
        control_hz=None,
        scenario=about.scenario,
        seed=0,
        record=record,
        command="fulmar faults",
        goals=_goals_file(record.parent, task) if about.by_goal_node else None,
        emulate=about.emulated,
        guards={"estop": True, **about.guards},
    )
    policy = _harmed_bundle(robot, task, record.parent, about.bundle) if about.bundle else request.plan.policy
    return replace(request, plan=replace(request.plan, duration_s=0.0, policy=policy))


def _goals_file(folder: Path, task: str) -> str:
    kind = {"go_to_pose": "poses", "go_to_position": "positions"}[task]
    places = [[*corner, 0.0] if kind == "poses" else list(corner) for corner in CORNERS_M]
    path = folder / "goals.yaml"
    path.write_text(yaml.safe_dump({"kind": kind, "title": "far away", kind: places}))
    return str(path)


def _harmed_bundle(robot: str, task: str, folder: Path, harm: Callable[[Path], None]) -> str:
    shipped = shipped_policy(robot, task)
    assert shipped is not None
    copy = Path(shutil.copytree(shipped, folder / "harmed"))
    harm(copy)
    return str(copy)
