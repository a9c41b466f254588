"""Basilisk as a simulator: the robots that it moves, and the Python that it runs in."""

from __future__ import annotations

from pathlib import Path

from fulmar_core.config.errors import ConfigError
from fulmar_core.config.other_environment import peers_python
from fulmar_core.robots.robot import Robot

BASILISK = "basilisk"


def is_for_basilisk(robot: Robot) -> bool:
    """Whether a robot floats in space: it has no weight, and touches neither floor, nor water, nor air."""
    return not robot.kind.weighs


def check_basilisk(robot: Robot) -> None:
    """Reject a robot that Basilisk does not simulate, and a missing environment.

    Raises:
        ConfigError: The robot is no spacecraft or satellite, or Basilisk's Python is missing.
    """
    if not is_for_basilisk(robot):
        raise ConfigError(
            f"Basilisk simulates spacecraft and satellites only, and '{robot.name}' is none. MuJoCo simulates it."
        )
    basilisk_python()


def basilisk_python() -> Path:
    """The Python that Basilisk runs in.

    Raises:
        ConfigError: It is missing.
    """
    return peers_python("Basilisk runs in an environment of its own")
