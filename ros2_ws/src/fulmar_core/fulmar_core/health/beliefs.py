"""What an estimator believes of valves and push that an operator should know, in words."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fulmar_core.actuators.thrusters import Thrusters
from fulmar_core.controllers.force_authority import ForceAuthority
from fulmar_core.health.thruster_health import Health
from fulmar_core.planar import to_body
from fulmar_core.robot import Robot

# Expected share of its thrust below which a valve counts as dead: that is likelier than not [-]
DEAD_BELOW = 0.5


@dataclass(frozen=True, slots=True)
class Beliefs:
    """Beliefs that are a warning.

    Attributes:
        dead: Names of the valves that are believed dead, in the robot's order.
        words: One sentence for each belief; empty where nothing is wrong.
    """

    dead: tuple[str, ...] = ()
    words: tuple[str, ...] = ()


class BeliefReader:
    """Finds what is wrong in the estimated health of one robot."""

    def __init__(self, robot: Robot) -> None:
        assert isinstance(robot.actuators, Thrusters)
        self._names, self._reach = robot.actuators.names, ForceAuthority(robot.actuators)
        self._torque = robot.performance.torque

    def read(self, health: Health) -> Beliefs:
        """Warn of valves believed dead, and of a push beyond what the valves can hold; `health` of one robot."""
        shares = dict(zip(self._names, health.effectiveness.tolist(), strict=True))
        dead = tuple(name for name, share in shares.items() if share < DEAD_BELOW)
        words = [f"valve {name} believed dead (effectiveness {shares[name]:.2f})" for name in dead]
        if bool(health.held):
            words.append("the robot does not move, whatever its valves do: it is held, or stands without air")
        force = np.stack(to_body(health.motion[2], health.push[0], health.push[1]))
        if not self._reach.holds(force):
            words.append(f"a push of {np.hypot(*force):.2f} N is believed, beyond what the valves can hold")
        if abs(health.push[2]) > self._torque:
            words.append(
                f"a push of {health.push[2]:+.2f} N·m is believed, beyond the {self._torque:g} N·m of the valves"
            )
        return Beliefs(dead, tuple(words))
