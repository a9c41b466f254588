"""Checks that the optional parts a command needs are installed."""

from __future__ import annotations

from importlib.util import find_spec
from typing import TYPE_CHECKING

from fulmar_bringup.console import log_line
from fulmar_cli.installation.installed_as import install_command
from fulmar_core.config.errors import ConfigError
from sim_nodes.camera.opengl import check_loadable
from sim_nodes.jsbsim_loadable import check_jsbsim

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
    "bags": ("mcap", "rosbags", "mcap_ros2", "zstandard", "PIL"),
    "hardware": ("filterpy", "serial", "gpiod", "pymavlink"),
    "view": ("matplotlib",),
    "console": ("websockets",),
    "events": ("h5py", "hdf5plugin", "aedat"),
    "jsbsim": ("jsbsim",),
    "datasets": ("pyarrow", "av"),
    "foxglove": ("foxglove",),
    "rerun": ("rerun",),
    "train": ("torch", "stable_baselines3", "sb3_contrib", "gymnasium", "onnx", "tensorboard"),
    "gym": ("gymnasium",),  # which `train` brings, too
    "pettingzoo": ("pettingzoo",),
    "cluster": ("ray",),
    "wandb": ("wandb",),
}


def advice_for(error: ImportError) -> str | None:
    """What to do about a module that is missing or broken; None if no extra brings it."""
    if not isinstance(error, ModuleNotFoundError):
        return f"{str(error).partition(chr(10))[0]}. `fulmar doctor` says what is wrong here."
    missing = (error.name or "").partition(".")[0]
    return _advice([missing]) if _extra_of(missing) else None


def require(*modules: str) -> None:
    """Refuse to begin work that would fail later for lack of a module.

    Raises:
        ConfigError: For all modules that are not installed, for a MUJOCO_GL that MuJoCo cannot be loaded with, or for
            a JSBSim that cannot be loaded.
    """
    missing = [module for module in dict.fromkeys(modules) if find_spec(module) is None]
    if missing:
        raise ConfigError(_advice(missing))
    if "mujoco" in modules:
        check_loadable()
    if "jsbsim" in modules:
        check_jsbsim()


def check_plan(plan: RunPlan, *, through: str = "ros") -> None:
    """Refuse a plan whose nodes would fail for lack of a module, and log where default gains are used.

    Args:
        plan: What is to run.
        through: `ros`, or what runs it in place of nodes: the plan's simulator, or `batch` for Fulmar's own dynamics.

    Raises:
        ConfigError: For all modules that are not installed.
    """
    from fulmar_bringup.node_spec import CONTROLLER
    from fulmar_bringup.system import gains_note, modules_of

    notes = [gains_note(plan.robot, name) for name in (plan.controller, plan.guards.fallback)]
    for note in dict.fromkeys(filter(None, notes)):
        log_line(f"info: {note}")
    if plan.only == CONTROLLER:
        require("rclpy", *modules_of(plan.controller, ""))
        return
    require(
        *(("rclpy", "mcap", "rosbags") if through == "ros" else ()),
        *modules_of(
            "external" if plan.only else plan.controller,
            "mock" if through == "batch" else plan.backend,
            guards=plan.guards,
            hardware=plan.hardware,
            emulated=plan.emulated,
            camera="camera" in plan.extras,
        ),
    )


def _extra_of(module: str) -> str:
    return next((extra for extra, modules in EXTRAS.items() if module in modules), "")


def _advice(missing: list[str]) -> str:
    """One line about modules that are not installed, with the command that installs all that extras bring."""
    names = _listed(missing)
    extras = list(dict.fromkeys(filter(None, map(_extra_of, missing))))
    if not extras:
        return f"this command needs {names}, which no extra of fulmar brings: install it with pip."
    brought = (
        f"the extra {_listed(extras)} brings" if len(extras) == 1 else f"the extras {_listed(extras)} bring"
    )
    return f"this command needs {names}, which {brought}. Run: {install_command(extras, missing)}"


def _listed(names: list[str]) -> str:
    quoted = [f"'{name}'" for name in names]
    return " and ".join(filter(None, (", ".join(quoted[:-1]), quoted[-1])))
