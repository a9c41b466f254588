"""The system that a fault is done to, where it is another than the usual one."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import yaml

from fulmar_bringup.planning import RunRequest, plan_run
from fulmar_core.topics import ODOMETRY, Wire
from policy_server.controllers import shipped_policy

FAR_M = 6.0  # the robot is under way for seconds
CORNERS_M = ((FAR_M, 0.0), (FAR_M, 1.0))  # where a node of goals sends it


@dataclass(frozen=True)
class FaultEnvironment:
    """What is unusual about a system; the usual one has an e-stop, and its odometry may be intercepted."""

    guards: Mapping[str, Any] = field(default_factory=dict)  # beside the e-stop
    intercepted: Wire | None = (
        ODOMETRY  # the wire that passes through the injector; None: the robot's commands
    )
    answers_pass: bool = False  # the robot's commands, too, pass through a injector, of their own
    by_goal_node: bool = False  # a node of its own tells goals from a file
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
