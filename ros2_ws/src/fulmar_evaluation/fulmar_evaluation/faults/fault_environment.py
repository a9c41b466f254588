"""The system that a fault is done to, and the relay that changes messages on their way."""

from __future__ import annotations

import shutil
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from geometry_msgs.msg import PoseStamped, QuaternionStamped, TwistStamped
from nav_msgs.msg import Odometry
from rclpy.node import Node
from sensor_msgs.msg import Imu, JointState

from fulmar_bringup.completion import completed
from fulmar_bringup.plan_checks import checked
from fulmar_bringup.run_plan import RunPlan
from fulmar_bringup.system import Guards
from fulmar_core.config.process import CONTROL_PRIORITY, take_priority_with_helpers
from fulmar_core.config.yaml_text import dump
from fulmar_core.dynamics.flight_trim import find_trim
from fulmar_core.estimators.kinds import default_estimator
from fulmar_core.robots.kinds.aircraft import AIRCRAFT
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import (
    COMMAND,
    GOAL_POINT,
    GOAL_POSE,
    IMU,
    MOCAP,
    ODOMETRY,
    SENSOR_WIRES,
    VELOCITY_COMMAND,
    Wire,
)
from fulmar_core.safety.geofence import NO_AREA
from fulmar_core.states.spatial import SpatialState
from fulmar_core.tasks import Task, load_task
from fulmar_evaluation.faults.by_kind import STAYS, UNSEEN
from fulmar_ros.qos import publisher_qos, subscriber_qos
from policy_server.controllers import shipped_policy

ATTITUDE = SENSOR_WIRES["star_tracker"]
KINDS = {
    ODOMETRY: Odometry,
    IMU: Imu,
    MOCAP: PoseStamped,
    COMMAND: JointState,
    VELOCITY_COMMAND: TwistStamped,
    ATTITUDE: QuaternionStamped,
}
FROM_PLANT = (IMU, MOCAP, ATTITUDE)
Injection = Callable[[Any], Any]  # a message to what is passed on in its place, or to None


def source_of(wire: Wire) -> str:
    """Where messages of a wire come from before they are passed on."""
    return f"original/{wire.name}"


def unchanged(message: Any) -> Any:
    """As it came."""
    return message


def lost(_message: Any) -> None:
    """Nothing passes."""


def delayed(seconds: float) -> Injection:
    """Each message comes later by so much at least, with the first one that comes then [s]."""
    waiting: deque[tuple[float, Any]] = deque()

    def change(message: Any) -> Any:
        now_s = time.monotonic()
        waiting.append((now_s, message))
        return waiting.popleft()[1] if now_s - waiting[0][0] >= seconds else None

    return change


class FaultInjector:
    """Passes messages on; `change` changes each, or swallows it by returning None."""

    def __init__(self, node: Node, wire: Wire) -> None:
        """Begin as if it were not there, with the priority of the nodes that it stands between."""
        self.change: Injection = unchanged
        self._begins = True
        kind, reliable = KINDS[wire], wire.delivery != "best_effort"
        self._publisher = node.create_publisher(kind, wire.name, publisher_qos(wire))
        node.create_subscription(
            kind, source_of(wire), self._pass, subscriber_qos(wire, reliable=reliable, depth=10)
        )

    def _pass(self, message: Any) -> None:
        if self._begins:
            take_priority_with_helpers(CONTROL_PRIORITY)
            self._begins = False
        changed = self.change(message)
        if changed is not None:
            self._publisher.publish(changed)


HELD = AIRCRAFT.far_goal  # where an aircraft begins
AISLE_M = 100.0  # of its area, to either side
CORNER_M = 1.0  # from there to the second place that a node of goals sends it to, along y
ROOM_M = 2.0  # of an area beyond start and goal
POSITION = "go_to_position"  # what is done where no policy is shipped for the usual task


@dataclass(frozen=True)
class FaultEnvironment:
    """What is unusual about a system; the usual one has an e-stop, and is what people start."""

    estimated: bool = False  # odometry comes from the robot's default estimator
    has_area: bool = False  # the robot must not leave the surroundings of start and goal
    fallback: str | None = None  # classical controller behind the policy
    intercepted: Wire | None = None  # passes through an injector
    answers_pass: bool = False  # the robot's commands pass through an injector of their own
    by_goal_node: bool = False  # a goal node publishes goals from a file
    drawn: bool = False  # a node draws for viewers
    filmed: bool = False  # a node draws what the robot's camera sees
    by_hand: bool = False  # a node for teleoperation runs, and nobody touches it yet
    scenario: str = "nominal"
    emulated: bool = False  # a driver drives an emulated device
    two_hosts: bool = False  # the controller is on another one
    clock_of: str = ""  # node whose clock may step; empty: none
    bundle: Callable[[Path], None] | None = None  # what is done to the bundle before the start
    height_m: float = HELD[2]  # at which an aircraft begins [m]
    nadir: bool = False  # a satellite keeps pointing to the Earth, and turns with its orbit

    def guards_of(self, robot: Robot) -> Guards:
        """Guards beside those of the system."""
        return Guards(
            estop=True,
            estimator=default_estimator(robot) if self.estimated else None,
            fallback=self.fallback or None,
            area=area_of(robot) if self.has_area else NO_AREA,
        )

    def why_not(self, robot: Robot) -> str:
        """Why a robot cannot be in such a system; empty if it can."""
        turns, flies = not robot.kind.goes_anywhere, not robot.kind.stays
        if not robot.kind.goal_task:
            return ""
        reasons = {
            "no policy is shipped for it": not _has_policy(robot)
            and (self.bundle is not None or self.fallback is not None),
            STAYS: turns and self.has_area,
            UNSEEN: self.intercepted == MOCAP or (flies and self.estimated),
            "only its own controllers drive it": self.by_hand,
            "no goal file holds what it flies along": flies and self.by_goal_node,
        }
        return next((reason for reason, counts in reasons.items() if counts), "")


USUAL = FaultEnvironment()
RELAYED = FaultEnvironment(intercepted=ODOMETRY)
COMMANDS = FaultEnvironment(answers_pass=True)


def task_of(robot: Robot) -> Task:
    """What a robot does when a fault comes: what is usual, or goes to a position."""
    if robot.kind.goal_task:
        return load_task(robot.kind.goal_task)
    fitting = (robot.kind.usual_task, POSITION + robot.state_type.SUFFIX)
    return load_task(next((task for task in fitting if shipped_policy(robot.name, task)), fitting[0]))


def _has_policy(robot: Robot) -> bool:
    return shipped_policy(robot.name, task_of(robot).name) is not None


def goal_of(robot: Robot) -> tuple[float, ...]:
    """Where it goes, as people write it [m, deg]."""
    return robot.kind.far_goal


def area_of(robot: Robot) -> tuple[float, ...]:
    """The surroundings of start and goal: two sides for each axis [m]."""
    goal = goal_of(robot)[: robot.state_type.AXES]
    if not robot.kind.stays:
        return (-ROOM_M, robot.limits.geofence, -AISLE_M, AISLE_M, -ROOM_M, goal[2] + ROOM_M)
    return tuple(side for far in goal for side in (-ROOM_M, far + ROOM_M))


def plan_of(name: str, record: Path, about: FaultEnvironment = USUAL) -> RunPlan:
    """A robot that has far to go, with an e-stop.

    Args:
        name: The robot's.
        record: Folder of the bag; files that are needed are made beside it.
        about: What is unusual.

    Raises:
        FulmarError: The robot has no controller to run.
    """
    robot = load_robot(name)
    task = load_task("point") if about.nadir else task_of(robot)
    asked = RunPlan(
        name,
        task.name,
        _controller_of(robot),
        "hardware" if about.emulated else "mujoco",
        goal=None if about.by_goal_node or about.nadir or not robot.kind.stays else goal_of(robot),
        start=_start_of(robot, about),
        scenario=about.scenario,
        goals=_goals_file(record.parent, robot, task) if about.by_goal_node else "",
        emulated=about.emulated,
        extras=tuple(name for name, runs in (("markers", about.drawn), ("camera", about.filmed)) if runs),
        guards=about.guards_of(robot),
        record=str(record),
        command="fulmar faults",
    )
    plan = checked(completed(asked))
    harmed = _harmed_bundle(name, task.name, record.parent, about.bundle) if about.bundle else plan.policy
    return replace(plan, duration_s=0.0, policy=harmed)


def _start_of(robot: Robot, about: FaultEnvironment) -> tuple[float, ...]:
    """Where it starts, as people write it: an aircraft in level flight [m, deg]; empty: as the task draws it."""
    if robot.airframe is not None:
        level = find_trim(robot, robot.airframe.speed, about.height_m).state
        return *HELD[:2], about.height_m, *SpatialState.written(level.pose)[3:]
    return () if about.nadir else (0.0,) * robot.state_type.AXES


def _controller_of(robot: Robot) -> str:
    """The policy; of kinds that have a law for it, where no policy is shipped, the classical controller."""
    return "policy" if _has_policy(robot) or not robot.kind.usual_law else "classical"


def _goals_file(folder: Path, robot: Robot, task: Task) -> str:
    kind = {GOAL_POSE.name: "poses", GOAL_POINT.name: "positions"}[task.goal_topic]
    far = list(goal_of(robot))
    corner = (
        [-number for number in far] if not robot.kind.goes_anywhere else [far[0], far[1] + CORNER_M, *far[2:]]
    )
    places = [place if kind == "poses" else place[: robot.state_type.AXES] for place in (far, corner)]
    path = folder / "goals.yaml"
    path.write_text(dump({"kind": kind, "title": "far away", kind: places}))
    return str(path)


def _harmed_bundle(robot: str, task: str, folder: Path, harm: Callable[[Path], None]) -> str:
    shipped = shipped_policy(robot, task)
    assert shipped is not None
    copy = Path(shutil.copytree(shipped, folder / "harmed"))
    harm(copy)
    return str(copy)
