"""Calibration: values measured on one robot, in place of those in the YAML of its kind.

`fulmar identify` writes such a file; `--calibration FILE` of `run`, `evaluate` and `train` uses it. It travels in the
environment variable FULMAR_CALIBRATION, so that every process of a run loads the same robot: the simulator, the
controllers that compute with its mass, and the workers of a training.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

from fulmar_core.config.errors import ConfigError
from fulmar_core.config.strict_yaml import load_config
from fulmar_core.config.yaml_text import dump
from fulmar_core.robots.actuators.thrusters import Thrusters
from fulmar_core.robots.robot import Robot

VARIABLE = "FULMAR_CALIBRATION"
DRAGS = (("surge", 0), ("sway", 1), ("yaw", 5))  # axes, with their index among the six of `Hydrodynamics`


@dataclass(frozen=True)
class Measured:
    """A number and the interval that holds it with 95 % confidence."""

    value: float
    low: float
    high: float

    def __post_init__(self) -> None:
        if not self.low <= self.value <= self.high:
            raise ValueError(f"low <= value <= high is needed, found {self.low}, {self.value}, {self.high}.")


@dataclass(frozen=True)
class Calibration:
    """One file; what is not in it stays as in the robot's YAML."""

    robot: str
    runs: tuple[str, ...] = ()  # bags that it was made from
    mass: Measured | None = None  # [kg]
    roll_inertia: Measured | None = None  # of bodies in space, about the centre of mass [kg·m²]
    pitch_inertia: Measured | None = None  # same
    yaw_inertia: Measured | None = None  # about the centre of mass [kg·m²]
    center_of_mass_x: Measured | None = None  # ahead of the body's origin [m]
    center_of_mass_y: Measured | None = None  # to its left [m]
    center_of_mass_z: Measured | None = None  # above it, of bodies in space [m]
    thrust: Measured | None = None  # of one valve that is open alone [N]
    delay: Measured | None = None  # from command to action, with that of the odometry [s]
    opening_delay: Measured | None = None  # by which valves open later than they close [s]
    surge_linear_drag: Measured | None = None  # [N per m/s]
    surge_quadratic_drag: Measured | None = None  # [N per (m/s)²]
    sway_linear_drag: Measured | None = None
    sway_quadratic_drag: Measured | None = None
    yaw_linear_drag: Measured | None = None  # [N·m per rad/s]
    yaw_quadratic_drag: Measured | None = None  # [N·m per (rad/s)²]
    wheel_scale: Measured | None = None  # speed over commanded speed [-]
    turn_scale: Measured | None = None  # turn rate over commanded turn rate [-]
    lag: Measured | None = None  # of the wheels' servos [s]

    @property
    def measured(self) -> dict[str, Measured]:
        """Everything that was measured, by name."""
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        return {name: value for name, value in values.items() if isinstance(value, Measured)}


def load_calibration(path: Path) -> Calibration:
    """Read a file that `fulmar identify --out` wrote.

    Raises:
        ConfigError: It is missing, or there is a mistake in it.
    """
    return load_config(Calibration, path)


def save_calibration(calibration: Calibration, path: Path) -> None:
    """Write what `load_calibration` reads, with the digits that mean something."""
    document: dict[str, Any] = {"robot": calibration.robot}
    if calibration.runs:
        document["runs"] = list(calibration.runs)
    for name, found in calibration.measured.items():
        document[name] = {part: float(f"{getattr(found, part):.7g}") for part in ("value", "low", "high")}
    path.parent.mkdir(parents=True, exist_ok=True)
    head = "# Made by `fulmar identify`; use it with --calibration. SI units, intervals of 95 % confidence.\n"
    path.write_text(head + dump(document), encoding="utf-8")


def calibration_path() -> Path | None:
    """The file in use, if there is one."""
    text = os.environ.get(VARIABLE, "")
    return Path(text) if text else None


def calibration_in_use() -> Calibration | None:
    """The calibration of the file in use, if there is one.

    Raises:
        ConfigError: It cannot be read.
    """
    path = calibration_path()
    return None if path is None else load_calibration(path)


def calibrated(robot: Robot, calibration: Calibration) -> Robot:
    """A robot with its measured values; scenarios with an uncertain body draw from the measured intervals.

    Raises:
        ConfigError: A value was measured that this robot does not have, or that no robot can have.
    """
    foreign = set(calibration.measured) - set(_places(robot))
    if foreign:
        raise ConfigError(
            f"calibration of '{robot.name}': '{min(foreign)}' is nothing that this robot has; "
            f"allowed: {', '.join(_places(robot))}."
        )
    try:
        return _actuators(_water(_body(robot, calibration), calibration), calibration)
    except ValueError as error:
        raise ConfigError(f"calibration of '{robot.name}': {error}") from error


def _places(robot: Robot) -> tuple[str, ...]:
    """Names of the quantities that a calibration of this robot may have."""
    found = robot.actuators.calibrated
    if not found and robot.hydrodynamics is not None:
        found = tuple(f"{axis}_{kind}_drag" for axis, _ in DRAGS for kind in ("linear", "quadratic"))
    return (*robot.kind.calibrated, *found) if found else ()


def _body(robot: Robot, calibration: Calibration) -> Robot:
    body, spans = robot.body, robot.uncertainty
    mass, inertia = calibration.mass, calibration.yaw_inertia
    cx, cy, cz = (getattr(calibration, f"center_of_mass_{axis}") for axis in "xyz")
    if mass:
        body, spans = replace(body, mass=mass.value), replace(spans, mass=(mass.low, mass.high))
    if inertia:
        # As in the simulators: roll and pitch grow and shrink with yaw.
        roll, pitch, yaw = (part * inertia.value / body.inertia[2] for part in body.inertia[:3])
        if calibration.roll_inertia and calibration.pitch_inertia:
            roll, pitch = calibration.roll_inertia.value, calibration.pitch_inertia.value
        body = replace(body, inertia=(roll, pitch, yaw, *body.inertia[3:]))
        spans = replace(spans, yaw_inertia=(inertia.low, inertia.high))
    if cx and cy:
        found = (cx, cy, cz) if cz else (cx, cy)
        reach = sum(max(c.high - c.value, c.value - c.low) ** 2 for c in found) ** 0.5
        body = replace(body, center_of_mass=tuple(c.value for c in found))
        spans = replace(spans, center_of_mass=reach)
    return replace(robot, body=body, uncertainty=spans)


def _water(robot: Robot, calibration: Calibration) -> Robot:
    water = robot.hydrodynamics
    if water is None:
        return robot
    dampings: dict[str, Any] = {}
    for kind in ("linear", "quadratic"):
        values = list(getattr(water, f"{kind}_damping"))
        for axis, i in DRAGS:
            found = getattr(calibration, f"{axis}_{kind}_drag")
            if found:
                values[i] = max(found.value, 0.0)  # noise may put a drag of nothing below nothing
        dampings[f"{kind}_damping"] = tuple(values)
    return replace(robot, hydrodynamics=replace(water, **dampings))


def _actuators(robot: Robot, calibration: Calibration) -> Robot:
    actuators, performance = robot.actuators, robot.performance
    response = actuators.response
    if calibration.delay:
        response = replace(response, delay_s=max(calibration.delay.value, 0.0))
    if calibration.opening_delay:
        response = replace(response, opening_delay_s=max(calibration.opening_delay.value, 0.0))
    if calibration.lag:
        response = replace(response, lag_s=calibration.lag.value)
    if calibration.wheel_scale and calibration.turn_scale:
        response = replace(response, gain=(calibration.wheel_scale.value, calibration.turn_scale.value))
    if calibration.thrust:
        factor = calibration.thrust.value / robot.actuated_by(Thrusters).thrust
        actuators = replace(robot.actuated_by(Thrusters), thrust=calibration.thrust.value)
        performance = replace(
            performance, force=factor * performance.force, torque=factor * performance.torque
        )
    return replace(robot, actuators=replace(actuators, response=response), performance=performance)
