"""Checks of the nodes that a plan has because it was asked for them."""

from __future__ import annotations

import importlib.util

from fulmar_bringup.run_plan import RunPlan
from fulmar_core.config.errors import ConfigError
from fulmar_core.loop.pursuit import checked_task
from fulmar_core.tasks import Task

# Messages that a node needs, and the command that builds them.
NEEDED = {
    "actions": ("nav2_msgs", "install-actions"),
    "simulation_interfaces": ("simulation_interfaces", "install-interfaces"),
    "broadcast": ("control_msgs", "install-interfaces"),
}


def check_extras(plan: RunPlan, task: Task) -> None:
    """Refuse nodes that were asked for and can do nothing.

    Raises:
        ConfigError: The task goes to no place, a device would have to be simulated, or messages are missing.
    """
    if "actions" in plan.extras:
        checked_task(task)
    if "simulation_interfaces" in plan.extras and plan.backend == "hardware":
        raise ConfigError(
            "--simulation-interfaces resets, steps and moves simulations, and --backend hardware is none. "
            "Take --backend mujoco, mock or jsbsim, or leave it out."
        )
    for name, (package, command) in NEEDED.items():
        if name in plan.extras and importlib.util.find_spec(package) is None:
            raise ConfigError(
                f"--{name.replace('_', '-')} needs the messages of {package}, which is not installed. "
                f"Run: fulmar {command}"
            )
