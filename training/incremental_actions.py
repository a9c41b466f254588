"""Orders to actuators that take time to follow: as far astern as they go, as they are, or as far ahead.

What is quickest for an actuator that slews is nearly always one of the three, and a choice among three keeps trying
both ways round where a normal distribution settles between them (Seyde et al., "Is Bang-Bang Control All You Need?",
arXiv 2111.02552). Slew turns orders into commands: where it allows a tenth a step, "ahead" adds a tenth.
"""

from __future__ import annotations

from typing import Any

from fulmar_core.errors import ConfigError
from fulmar_core.robot import Robot

KINDS = 3  # of orders to one actuator: astern, as it is and ahead; numbered 0, 1 and 2 where they are chosen


def shares_asked(orders: Any, previous: Any) -> Any:
    """What orders ask for.

    Args:
        orders: -1, 0 or 1 for each actuator, shape (..., m).
        previous: Its last command as a share of the full one, same shape.

    Returns:
        Shares of full command, same shape; slew lets actuators come only so near to them in one step.
    """
    return orders + (orders == 0) * previous


def check_orders(robot: Robot) -> None:
    """Refuse robots whose actuators follow at once, since they would only ever be full ahead or full astern.

    Raises:
        ConfigError: The robot has no slew.
    """
    if not robot.actuators.response.slew:
        raise ConfigError(
            f"'orders': the actuators of '{robot.name}' have no slew, and would be full ahead or full astern. "
            "Leave 'orders' out."
        )
