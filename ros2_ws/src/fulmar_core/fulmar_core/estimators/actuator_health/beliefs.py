"""What is believed of valves, fans and pushes that an operator should know, in words."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fulmar_core.estimators.actuator_health.thruster_health import Health
from fulmar_core.robots.actuators.force_authority import ForceAuthority
from fulmar_core.robots.actuators.thrusters import Thrusters
from fulmar_core.robots.robot import Robot
from fulmar_core.states.planar import to_body

# Expected share of its thrust below which a valve counts as dead: that is likelier than not [-]
DEAD_BELOW = 0.5
DEAD = "believed dead"
NO_EFFECT = "the robot does not move, whatever its valves do: it is held, or stands without air"


@dataclass(frozen=True, slots=True)
class Beliefs:
    """Beliefs that are a warning.

    Attributes:
        dead: Names of the valves that are believed dead, in the robot's order.
        words: One sentence for each belief; empty where nothing is wrong.
        open: Names of those that are believed stuck open.
        warnings: The same without numbers, which change at every step.
    """

    dead: tuple[str, ...] = ()
    words: tuple[str, ...] = ()
    open: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()


NOTHING = Beliefs()


def joined(estimated: Beliefs, monitored: Beliefs, suspects: tuple[str, ...]) -> Beliefs:
    """Beliefs of a monitor, and those of a controller's estimator that the monitor shares.

    The estimator knows dead valves and pushes only: it takes a valve that is stuck open for others that are dead.

    Args:
        estimated: Of the estimator.
        monitored: Of the monitor.
        suspects: Names of actuators that the monitor takes for dead rather than not.
    """
    numbered = {word.split(" (")[0]: word for word in estimated.words}
    confirmed = tuple(name for name in estimated.dead if name in suspects and name not in monitored.dead)
    added = [said_dead("valve", name) for name in confirmed]
    words = [numbered.get(word, word) for word in (*monitored.warnings, *added)]
    if not monitored.open:
        accused = {said_dead("valve", name) for name in estimated.dead}
        words += [word for start, word in numbered.items() if start not in accused and word not in words]
    dead = (*monitored.dead, *confirmed)
    return Beliefs(dead, tuple(words), monitored.open, (*monitored.warnings, *added))


def said_dead(noun: str, name: str) -> str:
    """What is said of a dead actuator."""
    return f"{noun} {name} {DEAD}"


class BeliefReader:
    """Finds what is wrong in the estimated health of one robot."""

    def __init__(self, robot: Robot) -> None:
        thrusters = robot.actuated_by(Thrusters)
        self._names, self._reach = thrusters.names, ForceAuthority(thrusters)
        self._torque = robot.performance.torque

    def read(self, health: Health) -> Beliefs:
        """Warn of valves believed dead, and of a push beyond what the valves can hold; `health` of one robot."""
        ahead, left, torque = health.push.tolist()
        small = math.hypot(ahead, left) < self._reach.at_least and abs(torque) <= self._torque
        if small and not bool(health.held) and health.effectiveness.min() >= DEAD_BELOW:
            return NOTHING
        shares = dict(zip(self._names, health.effectiveness.tolist(), strict=True))
        dead = tuple(name for name, share in shares.items() if share < DEAD_BELOW)
        words = [f"{said_dead('valve', name)} (effectiveness {shares[name]:.2f})" for name in dead]
        if bool(health.held):
            words.append(NO_EFFECT)
        force = np.stack(to_body(health.motion[2], health.push[0], health.push[1]))
        if not self._reach.holds(force):
            words.append(f"a push of {np.hypot(*force):.2f} N is believed, beyond what the valves can hold")
        if abs(health.push[2]) > self._torque:
            words.append(
                f"a push of {health.push[2]:+.2f} N·m is believed, beyond the {self._torque:g} N·m of the valves"
            )
        return Beliefs(dead, tuple(words))
