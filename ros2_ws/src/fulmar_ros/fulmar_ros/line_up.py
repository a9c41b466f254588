"""Who controls at first, and who stands by: the controller that was asked for, and its fallback."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

from fulmar_core.controller_settings import ControllerSettings
from fulmar_core.controllers.classical import load_classical
from fulmar_core.controllers.controller import Controller
from fulmar_core.errors import FulmarError
from fulmar_core.robot import Robot
from fulmar_core.safety.fallback import ControllerSwitch, Standby, warm_up
from fulmar_core.tasks import Task

MakeController = Callable[[Robot, Task, ControllerSettings], Controller]


def line_up(
    make_controller: MakeController,
    robot: Robot,
    task: Task,
    settings: ControllerSettings,
    complain: Callable[[str], object],
) -> ControllerSwitch[Standby]:
    """The controller that was asked for, or, where it is refused and one is named, its fallback.

    Args:
        make_controller: Loads the one that was asked for.
        robot: The robot.
        task: What it shall do.
        settings: Of the node.
        complain: Told why the fallback begins.

    Raises:
        FulmarError: Both are refused, or the one is and no other is named.
        ImportError: A library is missing, and no fallback is named.
    """
    fallback = _fallback(robot, task, settings)
    try:
        first = warm_up(make_controller(robot, task, settings), robot, task)
    except (FulmarError, ImportError) as error:
        if fallback is None:
            raise
        complain(f"falling back to {settings.fallback}: {error}")
        return ControllerSwitch(None, fallback, refused=str(error))
    return ControllerSwitch(first, fallback)


def load_other(
    make_controller: MakeController,
    robot: Robot,
    task: Task,
    settings: ControllerSettings,
    folder: str,
) -> Standby:
    """Another policy, ready to take over; the other arguments as of `line_up`.

    Raises:
        FulmarError: It cannot take the place of the one that runs.
    """
    return warm_up(make_controller(robot, task, dataclasses.replace(settings, policy=folder)), robot, task)


def _fallback(robot: Robot, task: Task, settings: ControllerSettings) -> Standby | None:
    name = settings.fallback
    if not name:
        return None
    law = None if name == "classical" else name
    controller = load_classical(robot, task, control_hz=settings.control_rate(robot), law=law)
    return warm_up(controller, robot, task, said={"fallback": True})
