"""Which robots and tasks there are plans for, and how a planner is loaded; light until one is."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from fulmar_core.actuators.propellers import Propellers
from fulmar_core.config import load_config
from fulmar_core.controllers.controller import Controller
from fulmar_core.errors import ConfigError
from fulmar_core.paths import config_names, config_path
from fulmar_core.robot import Robot
from fulmar_core.tasks import Task

if TYPE_CHECKING:
    from policy_server.planning.planner import Planner

TASKS = ("go_through_positions",)  # whose courses are told whole, and of which enough waypoints are seen


def check_planner(robot: Robot, task: Task) -> None:
    """Refuse a robot and a task that no plan can be made for.

    Raises:
        ConfigError: With what would be allowed.
    """
    actuators = robot.actuators
    if not isinstance(actuators, Propellers) or robot.hydrodynamics is None or not actuators.response.slew:
        raise ConfigError(
            f"controller 'planner' is for boats with propellers that slew; '{robot.name}' has {actuators.kind}. "
            "Use --controller policy."
        )
    if task.kind not in TASKS:
        raise ConfigError(
            f"controller 'planner' plans no '{task.name}'; it does: {', '.join(TASKS)}. Use --controller policy."
        )
    settings_path(robot.name)


def settings_path(robot: str) -> Path:
    """The file that says how plans for a robot are made.

    Raises:
        ConfigError: There is none.
    """
    name = f"{robot}_planner"
    if name not in config_names("controllers"):
        raise ConfigError(
            f"nothing says how to plan for '{robot}'. Write configs/controllers/{name}.yaml, or "
            f"controllers/{name}.yaml beside robots/ of your own, as configs/controllers/kingfisher_planner.yaml is."
        )
    return config_path("controllers", name)


def load_planner(robot: Robot, task: Task, folder: Path, *, control_hz: float) -> Controller:
    """A planner with the policy of a folder, which waits for its plans.

    Raises:
        ConfigError: There are no plans for the pair, or a mistake in the settings.
        BundleError: As of `Policy`.
    """
    from policy_server.policy import Policy

    check_planner(robot, task)
    return planner_with(robot, task, lambda: Policy(folder, robot, task, control_hz=control_hz), patient=True)


def planner_with(
    robot: Robot, task: Task, make_policy: Callable[[], Controller], *, patient: bool
) -> Planner:
    """A planner for a pair that `check_planner` takes; arguments as of `Planner`."""
    from policy_server.planning.planner import Planner
    from policy_server.planning.settings import PlannerSettings

    settings = load_config(PlannerSettings, settings_path(robot.name))
    return Planner(robot, task, make_policy, settings, patient=patient)
