"""Which part of a robot sticks in an episode, and when; how far its supply falls."""

from __future__ import annotations

from fnmatch import fnmatchcase

import numpy as np

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot import Robot
from fulmar_core.states.counter_rng import Draws
from fulmar_core.states.rotation import Array
from fulmar_core.worlds.parts import Actuation, Stuck

NONE, NEVER_S = -1.0, 1e9  # number of the part and time, where none sticks; finite, as all of a world
BRANCH = 1  # of the numbers that worlds are drawn from, so that the others stay


def draw_changes(robot: Robot, actuation: Actuation, draws: Draws) -> dict[str, Array]:
    """Draw what happens to the actuators within some episodes, as fields of their worlds.

    Raises:
        ConfigError: The robot has none of the parts that are to stick, or they do not reach the value.
    """
    stuck, supply = actuation.stuck, actuation.supply
    zero = np.zeros(draws.worlds)
    part, from_s = zero + NONE, zero + NEVER_S
    if stuck.actuators:
        own, candidates = draws.branch(BRANCH), candidates_of(robot, stuck)
        lots = np.asarray(own.uniform(0.0, len(candidates))).astype(int)
        part = np.asarray(candidates, dtype=float)[lots]
        from_s = own.uniform(*stuck.from_s)
    return {
        "stuck_part": part,
        "stuck_at": zero + stuck.at,
        "stuck_from": from_s,
        "supply_left": zero + supply.left,
        "supply_from": zero + supply.from_s,
        "supply_over": zero + supply.over_s,
        "tank_fill": zero + supply.tank,
    }


def candidates_of(robot: Robot, stuck: Stuck) -> list[int]:
    """Numbers of the parts of a robot of which one sticks, in the order of `MovingParts.names`.

    Raises:
        ConfigError: It has none of them, or one does not reach the value.
    """
    parts = robot.actuators.parts
    found = [
        number
        for number, name in enumerate(parts.names)
        if any(fnmatchcase(name, pattern) for pattern in stuck.actuators)
    ]
    wanted = f"'actuation.stuck.actuators' [{', '.join(stuck.actuators)}]"
    if not found:
        raise ConfigError(f"{wanted}: '{robot.name}' has none of these, but {', '.join(parts.names)}.")
    for number in found:
        if stuck.at * parts.scale[number] < parts.lowest[number]:
            raise ConfigError(
                f"'actuation.stuck.at' = {stuck.at:g}: '{parts.names[number]}' of '{robot.name}' moves one way "
                "only. Give 0 to 1."
            )
    return found
