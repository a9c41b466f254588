"""What is shown of the actuators of robots of each kind."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable

from fulmar_ros.scene.robot_shapes import drive, plumes, torques
from fulmar_ros.scene.shape import Shape

# From a robot, its actuators, and what was applied, in the order of their names.
APPLIED: dict[str, Callable[..., list[Shape]]] = defaultdict(
    lambda: plumes, rolling=drive, satellite=torques, aircraft=lambda _robot, _actuators, _effort: []
)
