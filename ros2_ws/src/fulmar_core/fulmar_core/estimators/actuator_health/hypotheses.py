"""What may be wrong with valves or fans that measure nothing, and the wrench of a command in each case."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from enum import Enum

import numpy as np

from fulmar_core.robots.actuators.pushing import Pushing
from fulmar_core.robots.robot import Robot

HALF_OPEN, OPEN = 0.5, 1.0  # levels at which actuators that open by degrees are taken for stuck [-]
MOST_PAIRS = 28  # of dead actuators; robots with more than eight are searched for single ones alone
REMEMBERED = 256  # sequences of commands whose wrenches are not computed again
# Chances before anything is seen, and of what comes next when something changes. A push is no fault of an actuator.
PUSHED, POWERLESS, DEAD, STUCK_OPEN, DEAD_PAIR = 0.04, 0.005, 0.04, 0.02, 0.004


class Kind(Enum):
    """Kinds of hypotheses."""

    SOUND = "sound"
    PUSHED = "pushed"  # something from outside pushes, as it likes
    POWERLESS = "powerless"  # no command has an effect: the body is held, or has no supply
    DEAD = "dead"
    OPEN = "open"


@dataclass(frozen=True, slots=True)
class Hypothesis:
    """One way in which things may be.

    Attributes:
        kind: Its kind.
        stuck: Numbers of the actuators that do not follow their commands.
        level: What these do instead, a share of their full thrust [-].
        for_long: Since before what is believed of the push was learned; else from a moment on that comes.
    """

    kind: Kind
    stuck: tuple[int, ...] = ()
    level: float = 0.0
    for_long: bool = False


def can_monitor(robot: Robot) -> bool:
    """Whether faults of a robot's actuators show in its motion: valves or fans of what floats and does not fall."""
    return robot.actuators.one_way and robot.hydrodynamics is None and not robot.kind.lifted


class Hypotheses:
    """Every hypothesis about one robot, with its prior chance and the wrench that a command has under it."""

    def __init__(self, robot: Robot) -> None:
        """List them; the robot is one of `can_monitor`."""
        self._actuators = robot.actuated_by(Pushing)
        count = len(robot.actuators.names)
        levels = (OPEN,) if robot.actuators.binary else (HALF_OPEN, OPEN)
        pairs = list(itertools.combinations(range(count), 2))
        pairs = pairs if len(pairs) <= MOST_PAIRS else []
        opened = [
            Hypothesis(Kind.OPEN, (i,), level, for_long)
            for for_long in (False, True)
            for i in range(count)
            for level in levels
        ]
        groups = [
            (PUSHED, [Hypothesis(Kind.PUSHED)]),
            (POWERLESS, [Hypothesis(Kind.POWERLESS, tuple(range(count)))]),
            (DEAD, [Hypothesis(Kind.DEAD, (i,)) for i in range(count)]),
            (STUCK_OPEN, opened),
            (DEAD_PAIR, [Hypothesis(Kind.DEAD, pair) for pair in pairs]),
        ]
        self.all: list[Hypothesis] = [Hypothesis(Kind.SOUND)]
        priors = [1.0]
        for chance, group in groups:
            if not group:
                continue
            self.all += group
            priors += [chance / len(group)] * len(group)
        priors[0] -= sum(priors[1:])
        self.prior = np.array(priors)
        self._known: dict[bytes, np.ndarray] = {}
        self._obeys = np.ones((len(self.all), count))
        self._stuck = np.zeros((len(self.all), count))
        for row, each in enumerate(self.all):
            self._obeys[row, list(each.stuck)] = 0.0
            self._stuck[row, list(each.stuck)] = each.level
        gain = robot.actuators.response.gain or np.ones(count)
        self._wrench = np.asarray(gain)[:, None] * self._actuators.wrench_per_newton
        # Torque about the centre of mass.
        self._wrench[:, 3:] -= np.cross(np.array(robot.body.com), self._wrench[:, :3])

    def wrenches(self, commands: np.ndarray) -> np.ndarray:
        """Force and torque about the centre of mass, in the body's frame.

        Args:
            commands: One command after another, shape (k, n).

        Returns:
            Under each hypothesis, shape (k, hypotheses, 6) [N, N·m].
        """
        key = commands.tobytes()
        found = self._known.get(key)
        if found is None:
            if len(self._known) >= REMEMBERED:
                self._known.clear()
            applied = commands[:, None, :] * self._obeys + self._stuck
            found = self._known[key] = np.asarray(self._actuators.thrusts(applied) @ self._wrench)
        return found
