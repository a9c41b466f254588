"""Primary and fallback controller of a node."""

from __future__ import annotations

from collections.abc import Callable

from fulmar_core.config.errors import FulmarError
from fulmar_core.controllers.classical import load_classical
from fulmar_core.loop.controller_settings import ControllerSettings
from fulmar_core.loop.fallback import ControllerSwitch, Standby, warm_up
from fulmar_core.robots.robot import Robot
from fulmar_core.tasks import Task
from fulmar_ros.controller_loading import MakeController


def controllers_of(
    make_controller: MakeController,
    robot: Robot,
    task: Task,
    settings: ControllerSettings,
    complain: Callable[[str], object],
) -> ControllerSwitch[Standby]:
    """Primary controller and its fallback; where the primary is refused, the fallback begins, and `complain` says why.

    Raises:
        FulmarError: Both are refused, or the primary is and no fallback is named.
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


def _fallback(robot: Robot, task: Task, settings: ControllerSettings) -> Standby | None:
    name = settings.fallback
    if not name:
        return None
    law = None if name == "classical" else name
    controller = load_classical(robot, task, control_hz=settings.control_rate(robot), law=law)
    return warm_up(controller, robot, task, said={"fallback": True})
