"""Robots as read from their YAML, with the calibration in use."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

from fulmar_core.config.errors import ConfigError, ImplausibleError
from fulmar_core.config.paths import config_path
from fulmar_core.config.plausibility import check_plausible
from fulmar_core.config.plausible_ranges import RELATIONS, ROBOT
from fulmar_core.config.strict_yaml import load_config
from fulmar_core.robots.calibration import VARIABLE, calibrated, calibration_in_use, load_calibration
from fulmar_core.robots.look_files import with_mesh_files
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.sensors.camera import RANGES as CAMERA_RANGES
from fulmar_core.robots.sensors.table import RANGES
from fulmar_core.states.planar import PlanarState


def load_robot(name: str) -> Robot:
    """Read `configs/robots/<name>.yaml`, with the calibration in use if it is for this robot.

    Raises:
        ConfigError: Unknown name, or a mistake in the file.
    """
    path = config_path("robots", name)
    robot = load_robot_file(path)
    if robot.name != name:
        raise ConfigError(
            f"{path}: 'name' is '{robot.name}', the file's own name is '{name}'. Make them equal."
        )
    calibration = calibration_in_use()
    if calibration is None or calibration.robot != name:
        return robot
    try:
        return calibrated(robot, calibration)
    except ValueError as error:
        raise ConfigError(f"the calibration of '{name}': {error}") from None


def load_robot_file(path: Path) -> Robot:
    """Read a robot from any file, without a calibration.

    Raises:
        ConfigError: The file cannot be read.
        ImplausibleError: It can, and has values that no robot has.
    """
    robot = load_config(Robot, path)
    if any(part.file for part in robot.look):
        robot = replace(robot, look=with_mesh_files(robot.look, path))
    own = robot.actuators.ranges(robot)
    replaced = {row.key for row in own}
    rows = (*own, *(row for row in ROBOT if row.key not in replaced), *RANGES, *CAMERA_RANGES)
    # A number that is wrong by itself is named before one that does not fit to others.
    alone = [row for row in rows if row.scale is None]
    check_plausible(robot, (*alone, *RELATIONS, *(row for row in rows if row.scale is not None)), path)
    _check_spans(robot, path)
    return robot


def use_calibration(path: Path | None, robot: str) -> None:
    """Let this process, and whatever it starts from now on, load a robot as calibrated; None changes nothing.

    Raises:
        ConfigError: The file cannot be read, is for another robot, or has values that this robot does not have.
    """
    if path is None:
        return
    calibration = load_calibration(path)
    if calibration.robot != robot:
        raise ConfigError(
            f"{path} is for '{calibration.robot}', not for '{robot}'. Identify '{robot}' first."
        )
    os.environ.pop(VARIABLE, None)
    calibrated(load_robot(robot), calibration)
    os.environ[VARIABLE] = str(path.absolute())


def _check_spans(robot: Robot, path: Path) -> None:
    """Refuse a body that training under uncertainty would never see: a span was left as it was for another body."""
    spans, (roll, pitch, yaw) = robot.uncertainty, robot.body.inertia[:3]
    for name, key, nominal, widest, (low, high) in (
        ("mass", "body.mass", robot.body.mass, 3.0, spans.mass),
        ("yaw_inertia", "body.inertia.2", yaw, 6.0, spans.yaw_inertia),
        ("drag", "hydrodynamics", 1.0, 5.0, spans.drag),
    ):
        if not low <= nominal <= high:
            raise ImplausibleError(
                f"{path}: 'uncertainty' has {name}: [{low:g}, {high:g}], which "
                f"does not hold the body's own {nominal:g}, '{key}'. Correct whichever is wrong."
            )
        for end, value in enumerate((low, high)):
            if not nominal / widest <= value <= nominal * widest:
                raise ImplausibleError(
                    f"{path}: 'uncertainty.{name}.{end}' = {value:g} is not plausible around the body's {nominal:g}, "
                    f"'{key}': accepted is {nominal / widest:.4g} to {nominal * widest:.4g}."
                )
    # In space the whole tensor grows and shrinks with `yaw_inertia`: any factor leaves a body a body.
    if robot.state_type is PlanarState and spans.yaw_inertia[1] > roll + pitch:
        raise ImplausibleError(
            f"{path}: 'uncertainty' has yaw_inertia up to {spans.yaw_inertia[1]:g}; no body has a moment beyond "
            f"the sum of the two others, {roll + pitch:g}."
        )
