"""Which actuator of a body in space gives no thrust, as its motion shows, for the backup of the envelope guard.

The change of velocity and of turn rate over a control step is compared with what the two newest commands make of it,
with all actuators and with each of them dead. Every hypothesis may choose how late commands act and how strong thrust
is, both as far as is believed. The differences of the squared errors, half of which is a logarithm of likelihoods, add
up as long as they speak for the actuator (cumulative sum; Page 1954, "Continuous inspection schemes").
"""

from __future__ import annotations

import numpy as np

from fulmar_core.controllers.space_gains import weakest
from fulmar_core.robots.actuators.pushing import Pushing
from fulmar_core.robots.robot import Robot
from fulmar_core.safety.envelope.braking import Beliefs
from fulmar_core.safety.envelope.motion import REMEMBERED, Motion, in_body

CERTAIN = 7.0  # sum of log-likelihoods with which an actuator is taken for dead [-]
ONCE = 4.0  # that one step may add at most [-]
STRONGEST = 1.1  # thrust over the nominal one that hypotheses may choose [-]
NONE = -1  # no actuator
FORCE, TORQUE = slice(0, 3), slice(3, 6)
FAINT = 0.6  # of the least thrust that is believed, with which all actuators may still work [-]
LEAST = 1e-9  # squared length of what is divided by [-]


class DeadCheck:
    """Checks n bodies of one kind step by step.

    Attributes:
        dead: Which actuator of each is dead, `NONE` for none, shape (n,).
        alive: 0 for that one, else 1, shape (n, m).
        found: Whether any body has one.
        strength: Of the push in the weakest direction without it, over that of all, shape (n,) [-].
    """

    def __init__(
        self, robot: Robot, motion: Motion, beliefs: Beliefs, deviation: np.ndarray, dt: float, late_s: float
    ) -> None:
        """Take what is believed.

        Args:
            robot: One that floats in space.
            motion: Of it.
            beliefs: How far it may differ from its file.
            deviation: Of a measured change of velocity and turn rate, shape (2,) [m/s], [rad/s].
            dt: Time of a control step [s].
            late_s: Until a command acts, at worst [s].
        """
        self._motion, self._dt, self._deviation = motion, dt, np.repeat(deviation, 3)
        actuators = robot.actuated_by(Pushing)
        self._count = len(actuators.names)
        self._known: dict[bytes, np.ndarray] = {}
        # Where commands act later than believed, or thrust is weaker, no actuator is to blame. Shares of the step, and
        # of the thrust.
        self._late = np.array((1.0, *[min(late_s / dt, 1.0)] * self._count))
        least = beliefs.thrust / beliefs.mass, beliefs.thrust / beliefs.inertia
        self._weakest = np.array((np.multiply(FAINT, least), *[least] * self._count))
        self._left = _left(actuators) if robot.state_type.AXES == 3 else np.ones(self._count)
        self.reset(1)

    def reset(self, count: int) -> None:
        """Forget everything; there are so many bodies."""
        self._sums = np.zeros((count, self._count))
        self._before: np.ndarray | None = None  # what the command of the step before makes of a step
        self.dead = np.full(count, NONE)
        self.alive = np.ones((count, self._count))
        self.found, self.strength = False, np.ones(count)

    def pause(self) -> None:
        """Go on after a gap: what the last command was is not known."""
        self._before = None

    def see(self, middle: np.ndarray, change: np.ndarray, command: np.ndarray) -> None:
        """Take what a step changed.

        Args:
            middle: Attitude half-way, shape (n, 4).
            change: Of the velocity in the world, and of the turn rate less what the body's tumbling makes of it, shape
                (2, n, 3) [m/s], [rad/s].
            command: Of the step, shape (n, m).
        """
        now, before = self._of(command), self._before
        self._before = now
        if before is None or not (now.any() or before.any()):
            return
        moved = np.concatenate((in_body(middle, change[0]), change[1]), axis=1) / self._deviation
        error = self._error(moved.reshape(-1, 1, 2, 3), now, before)
        speaks = np.minimum(np.maximum(0.5 * (error[:, :1] - error[:, 1:]), -ONCE), ONCE)
        self._sums = np.maximum(self._sums + speaks, 0.0)
        sure = (self._sums.max(axis=1) > CERTAIN) & (self.dead == NONE)
        if sure.any():
            self.dead = np.where(sure, self._sums.argmax(axis=1), self.dead)
            self.alive = np.where(np.arange(self._count) == self.dead[:, None], 0.0, 1.0)
            self.found, self.strength = True, np.where(self.dead == NONE, 1.0, self._left[self.dead])

    def _error(self, found: np.ndarray, now: np.ndarray, before: np.ndarray) -> np.ndarray:
        """Squared error of each hypothesis with the delay and the thrust that suit it best, shape (n, 1 + m)."""
        other, missing = before - now, found - now
        size = np.maximum(np.einsum("ijkl,ijkl->ij", other, other), LEAST)
        late = np.einsum("ijkl,ijkl->ij", missing, other) / size
        late = np.minimum(np.maximum(late, 0.0), self._late)
        made = now + late[..., None, None] * other
        size = np.maximum(np.einsum("ijkl,ijkl->ijk", made, made), LEAST)
        gain = (found * made).sum(axis=3) / size
        gain = np.minimum(np.maximum(gain, self._weakest), STRONGEST)
        left = found - gain[..., None] * made
        return np.asarray(np.einsum("ijkl,ijkl->ij", left, left))

    def _of(self, command: np.ndarray) -> np.ndarray:
        """What a command makes of a step with all actuators, and with each of them dead, shape (n, 1 + m, 2, 3).

        Changes of the velocity and of the turn rate, in the body's frame and in standard deviations. Those of one robot
        are remembered.
        """
        if len(command) != 1:
            return self._made(command)
        key = command.tobytes()
        found = self._known.get(key)
        if found is None:
            if len(self._known) >= REMEMBERED:
                self._known.clear()
            found = self._known[key] = self._made(command)
        return found

    def _made(self, command: np.ndarray) -> np.ndarray:
        """See `_of`."""
        works = np.concatenate((np.ones((1, self._count)), 1.0 - np.eye(self._count)))
        force, moment = self._motion.wrench((command[:, None] * works).reshape(-1, self._count))
        made = np.concatenate((force / self._motion.mass, moment @ self._motion.turning), axis=1)
        scaled = np.asarray(self._dt * made / self._deviation)
        return scaled.reshape(len(command), 1 + self._count, 2, 3)


def _left(actuators: Pushing) -> np.ndarray:
    """Push in the weakest direction without each actuator, over that of all, shape (m,) [-]."""
    full = actuators.full_thrust[:, None] * actuators.wrench_per_newton
    rests = [np.delete(full, number, axis=0) for number in range(len(full))]
    every, *less = (
        np.array([weakest(of[:, part], shared=actuators.shared_pressure) for part in (FORCE, TORQUE)])
        for of in (full, *rests)
    )
    return np.array([(each / every).min() for each in less])
