"""The table of efforts by kind of robot: how it strives for its goal while it works."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass

from fulmar_core.robots.robot import Robot


def _thrust(robot: Robot) -> float:
    return robot.performance.force / robot.body.mass


def _banking(robot: Robot) -> float:
    return robot.performance.turning_acceleration


@dataclass(frozen=True)
class Effort:
    """What a robot can do, and what is no reason to stop it."""

    slack: float = (
        2.0  # errors up to so many tolerances are no reason: noise and steady pushes hold robots there [-]
    )
    authority: float = 0.2  # share of full command from which it counts as trying [-]
    speed: float = 1.0  # with which it nears its target, in its own speed [-]
    acceleration: Callable[[Robot], float] = _thrust  # towards it [m/s²]


EFFORTS = defaultdict(
    Effort,
    # Gusts move it all the time, and it returns to its course on a path that is not steep.
    aircraft=Effort(slack=20.0, authority=0.95, speed=0.1, acceleration=_banking),
)
