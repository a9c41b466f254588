"""Checks that the optional parts a command needs are installed."""

from __future__ import annotations

from importlib.util import find_spec
from typing import TYPE_CHECKING

from fulmar_bringup.console import log_line
from fulmar_cli.installed_as import install_command
from fulmar_core.errors import ConfigError

if TYPE_CHECKING:
    from fulmar_bringup.run_plan import RunPlan

# Which extra brings a module; the first of each extra stands for it in `fulmar doctor`.
EXTRAS: dict[str, tuple[str, ...]] = {
    "ros": (
        "rclpy",
        "diagnostic_msgs",
        "geometry_msgs",
        "lifecycle_msgs",
        "nav_msgs",
        "rosgraph_msgs",
        "sensor_msgs",
        "std_msgs",
        "std_srvs",
        "visualization_msgs",
    ),
    "sim": ("mujoco",),
    "policy": ("onnxruntime", "cryptography"),
    "bags": ("mcap", "rosbags", "mcap_ros2", "zstandard"),
    "hardware": ("filterpy", "serial", "gpiod", "pymavlink"),
    "view": ("matplotlib",),
    "datasets": ("pyarrow",),
    "train": ("torch", "stable_baselines3", "sb3_contrib", "gymnasium", "onnx", "tensorboard"),
    "cluster": ("ray",),
    "wandb": ("wandb",),
}


def advice_for(error: ModuleNotFoundError) -> str | None:
    """How to install a module that is missing; None if no extra brings it."""
    return _advice((error.name or "").partition(".")[0])


def require(*modules: str) -> None:
    """Refuse to begin work that would fail later for lack of a module.

    Raises:
        ConfigError: For the first module that is not installed.
    """
    for module in modules:
        if find_spec(module) is None:
            raise ConfigError(_advice(module) or f"this command needs '{module}', which is not installed.")


def check_plan(plan: RunPlan, *, backend: str = "") -> None:
    """Refuse a plan whose nodes would fail for lack of a module, and log where default gains are used.

    Args:
        plan: What is to run.
        backend: Backend that is used in place of the plan's.

    Raises:
        ConfigError: For the first module that is not installed.
    """
    from fulmar_bringup.system import gains_note, modules_of

    notes = [gains_note(plan.robot, name) for name in (plan.controller, plan.guards.fallback)]
    for note in dict.fromkeys(filter(None, notes)):
        log_line(f"info: {note}")
    if plan.only == "controller":
        require(*modules_of(plan.controller, ""))
        return
    require(
        *modules_of(
            "external" if plan.only else plan.controller,
            backend or plan.backend,
            guards=plan.guards,
            hardware=plan.hardware,
            emulated=plan.emulated,
        )
    )


def _advice(module: str) -> str | None:
    for extra, modules in EXTRAS.items():
        if module in modules:
            return (
                f"this command needs '{module}', which the extra '{extra}' brings. "
                f"Run: {install_command(extra, module)}"
            )
    return None
