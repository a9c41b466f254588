"""Runs in which the controller `excite` plays a goal file of torques on a satellite."""

from __future__ import annotations

from pathlib import Path

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.actuators.reaction_wheels import ReactionWheels
from fulmar_core.robots.robot import Robot
from fulmar_core.tasks.excitation import Torques
from fulmar_core.tasks.goal_files import load_goal_file, load_torques
from fulmar_core.tasks.torque_profiles import gain_of, profile_of

EXCITE = "excite"  # name of the controller


def excitation_of(goals: str, robot: Robot, controller: str) -> str:
    """What the controller's parameter `excitation` says: the name or the path of torques; empty for other goals.

    Raises:
        ConfigError: Unknown name, a mistake in the file, or a robot or a controller that plays no torques.
    """
    if not goals or not isinstance(load_goal_file(goals), Torques):
        return ""
    if not isinstance(robot.actuators, ReactionWheels):
        raise ConfigError(
            f"the goals '{goals}' are torques of reaction wheels; '{robot.name}' has {robot.actuators.kind}."
        )
    if controller != EXCITE:
        raise ConfigError(
            f"the goals '{goals}' are torques, and controller '{controller}' takes none. Say --controller {EXCITE}."
        )
    return str(Path(goals).absolute()) if goals.endswith(".yaml") else goals


def torques_note(goals: str, robot: Robot, controller: str) -> str:
    """Warning about torques under which wheels saturate, as their file wants; empty for all other goals.

    Raises:
        ConfigError: As in `excitation_of`.
    """
    torques = excitation_of(goals, robot, controller)
    if not torques:
        return ""
    file, wheels = load_torques(torques), robot.actuators
    assert isinstance(wheels, ReactionWheels)  # as in `excitation_of`
    gain = gain_of(robot.name, wheels)
    profile = profile_of(file.profile, wheels, gain=gain, seed=file.seed, saturate=file.saturate)
    return f"'{goals}' saturates the wheels of '{robot.name}', as its file wants" if profile.saturates else ""
