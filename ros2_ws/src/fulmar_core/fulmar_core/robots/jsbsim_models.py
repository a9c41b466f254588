"""JSBSim as a simulator, and the models that come with JSBSim: `jsbsim:L17` flies one where a robot's file names it."""

from __future__ import annotations

from fulmar_core.config.errors import ConfigError, did_you_mean
from fulmar_core.robots.robot import Robot

JSBSIM = "jsbsim"


def is_jsbsim(backend: str) -> bool:
    """Whether a backend is JSBSim, with whatever model."""
    return backend.partition(":")[0] == JSBSIM


def jsbsim_model(robot: Robot, backend: str) -> str:
    """The model of JSBSim's own that a backend asks for; empty for `jsbsim`, which flies the robot's own file.

    Raises:
        ConfigError: The robot is no aircraft, or its file does not name the model.
    """
    if robot.airframe is None:
        raise ConfigError(f"JSBSim flies aircraft only, and '{robot.name}' is none. MuJoCo simulates it.")
    _, colon, model = backend.partition(":")
    known = robot.airframe.jsbsim
    if not colon or model in known:
        return model
    if not known:
        raise ConfigError(
            f"{backend}: no model of JSBSim's own stands for '{robot.name}'. {JSBSIM} alone flies "
            f"its own file; 'airframe: {JSBSIM}: [NAME]' of a robot's file names others."
        )
    raise ConfigError(
        f"{backend}: JSBSim's '{model}' does not stand for '{robot.name}'.{did_you_mean(model, known)}"
    )
