"""Incremental actions for actuators with slew: full astern, hold, or full ahead.

The fastest command for an actuator with slew is nearly always one of the three. A categorical policy keeps trying both
directions, where a normal distribution settles between them (Seyde et al., "Is Bang-Bang Control All You Need?", arXiv
2111.02552). The slew limit makes them increments: where it allows a tenth a step, "ahead" adds a tenth.
"""

from __future__ import annotations

from typing import Any

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot import Robot

KINDS = 3  # of actions of one actuator: astern, hold and ahead; the policy numbers them 0, 1 and 2


def incremental_shares(actions: Any, previous: Any) -> Any:
    """Shares of full command that incremental actions stand for.

    Args:
        actions: -1, 0 or 1 for each actuator, shape (..., m).
        previous: Its last command as a share of the full one, same shape.

    Returns:
        Shares of full command, same shape; the slew limit decides how far one step comes towards them.
    """
    return actions + (actions == 0) * previous


def check_incremental(robot: Robot) -> None:
    """Reject robots without slew, whose actuators would only ever be full ahead or full astern.

    Raises:
        ConfigError: The robot has no slew.
    """
    if not robot.actuators.response.slew:
        raise ConfigError(
            f"'incremental_actions': the actuators of '{robot.name}' have no slew, and would be full ahead or full "
            "astern. Leave 'incremental_actions' out."
        )
