"""What to say when an optional part of Fulmar is not installed."""

from __future__ import annotations

from importlib.util import find_spec

from fulmar_core.errors import ConfigError

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
    """What to do about a module that is missing; None if no extra brings it."""
    return _advice((error.name or "").partition(".")[0])


def require(*modules: str) -> None:
    """Refuse to begin what would fail later, in a process of its own, for lack of a module.

    Raises:
        ConfigError: For the first module that is not installed.
    """
    for module in modules:
        if find_spec(module) is None:
            raise ConfigError(_advice(module) or f"this command needs '{module}', which is not installed.")


def _advice(module: str) -> str | None:
    for extra, modules in EXTRAS.items():
        if module in modules:
            return (
                f"this command needs '{module}', which the extra '{extra}' brings. "
                f"Run `make dev` in the checkout, or install 'fulmar[{extra}]'."
            )
    return None
