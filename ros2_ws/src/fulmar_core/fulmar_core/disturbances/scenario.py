"""A named set of disturbances, as read from `configs/scenarios/<name>.yaml`."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from fulmar_core.config import load_config
from fulmar_core.paths import config_path
from fulmar_core.robot import Robot


@dataclass(frozen=True)
class Scenario:
    """How far an episode may differ from the nominal robot in a still world."""

    title: str
    sensor_noise: bool
    body: Literal["nominal", "uncertain"]  # uncertain: mass and yaw inertia over the robot's whole span
    max_force: float  # of a constant force in a random direction [N]
    max_torque: float  # of a constant torque of random sign [N·m]

    def __post_init__(self) -> None:
        """Refuse negative magnitudes."""
        if min(self.max_force, self.max_torque) < 0.0:
            raise ValueError("max_force and max_torque must not be negative.")


@dataclass(frozen=True, slots=True)
class World:
    """One draw of a scenario: the body and the wrench of one episode."""

    mass: float  # [kg]
    inertia: tuple[float, float, float]  # [kg·m²]
    force_in_world: tuple[float, float, float]  # [N]
    torque_in_world: tuple[float, float, float]  # [N·m]


def load_scenario(name: str) -> Scenario:
    """Read `configs/scenarios/<name>.yaml`.

    Raises:
        ConfigError: Unknown name, or a mistake in the file.
    """
    return load_config(Scenario, config_path("scenarios", name))


def draw_world(robot: Robot, scenario: Scenario, rng: np.random.Generator) -> World:
    """Draw the world of one episode.

    Args:
        robot: Its body and the spans it is uncertain over.
        scenario: What may differ.
        rng: Generator of this episode; five numbers are drawn whatever the scenario, so that episodes of
            one seed begin alike in every scenario.

    Returns:
        The world.
    """
    mass_share, inertia_share, force_share, torque_share = rng.uniform(0.0, 1.0, 4)
    direction = rng.uniform(-math.pi, math.pi)
    ixx, iyy, izz = robot.body.inertia
    mass = robot.body.mass
    if scenario.body == "uncertain":
        mass = _between(robot.uncertainty.mass, mass_share)
        izz = _between(robot.uncertainty.yaw_inertia, inertia_share)
    force = scenario.max_force * force_share
    return World(
        mass,
        (ixx, iyy, izz),
        (force * math.cos(direction), force * math.sin(direction), 0.0),
        (0.0, 0.0, scenario.max_torque * (2.0 * torque_share - 1.0)),
    )


def _between(span: tuple[float, float], share: float) -> float:
    return span[0] + share * (span[1] - span[0])
