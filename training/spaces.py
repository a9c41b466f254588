"""Spaces of observations and actions, one definition for Gymnasium and Stable-Baselines3."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np

from fulmar_core.robot import Robot


def observation_space(terms: int) -> gymnasium.spaces.Box:
    """Unbounded float32 vector of so many observation terms."""
    return gymnasium.spaces.Box(-np.inf, np.inf, (terms,), np.float32)


def action_space(robot: Robot) -> gymnasium.Space[Any]:
    """One entry for each actuator: 0 or 1 for on/off valves, else a share of the full command in [-1, 1]."""
    count = len(robot.actuators.names)
    return gymnasium.spaces.MultiBinary(count) if robot.actuators.binary else shares_space(count)


def shares_space(count: int) -> gymnasium.spaces.Box:
    """So many shares in [-1, 1], float32."""
    return gymnasium.spaces.Box(-1.0, 1.0, (count,), np.float32)
