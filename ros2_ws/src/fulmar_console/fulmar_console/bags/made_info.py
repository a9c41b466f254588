"""`robot_info` of a bag of an earlier version, made of the files that the bag has attached."""

from __future__ import annotations

import json
from typing import Any

from fulmar_bags.contents import Bag
from fulmar_core.config.errors import FulmarError
from fulmar_core.loop.robot_info import RobotSetup, robot_info
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.safety.geofence import NO_AREA
from fulmar_core.tasks import Task, load_recorded_task, load_task
from fulmar_evaluation.rerun.embedded_configs import knowing_what_it_carries


def made_info(bag: Bag) -> dict[str, Any] | None:
    """What the plant would publish today; None where robot or task do not load: the page draws a plain body then."""
    with knowing_what_it_carries(bag):
        try:
            robot, task = load_robot(bag.robot), _task_of(bag)
            info = robot_info(robot, task or load_task(robot.kind.goal_task), _setup_of(bag))
            json.dumps(info, allow_nan=False)
        except (FulmarError, ValueError, TypeError, AttributeError):
            return None
    return info | {"task": task.name if task else "", "task_title": task.title if task else ""}


def _task_of(bag: Bag) -> Task | None:
    named = bag.info or {}
    try:
        return load_recorded_task(str(named.get("task") or ""), bag.path, str(named.get("thing") or ""))
    except FulmarError:
        return None


def _setup_of(bag: Bag) -> RobotSetup:
    """How the robot was started, as the record of the run says it."""
    record = bag.info or {}
    guards = record.get("guards") or {}
    return RobotSetup(
        name=bag.name,
        backend=str(record.get("backend") or "hardware"),
        emulated=bool(record.get("emulated")),
        scenario=str(record.get("scenario") or ""),
        controller=str(record.get("controller") or ""),
        fallback=str(guards.get("fallback") or ""),
        area=tuple(guards.get("area") or NO_AREA),
        control_hz=bag.number("control_hz", 0.0),
        lockstep=bool(record.get("lockstep")),
        rate=bag.number("rate", 1.0),
    )
