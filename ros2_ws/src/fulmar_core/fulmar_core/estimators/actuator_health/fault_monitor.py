"""Monitor of valves and fans that measure nothing: what is believed of them while a robot moves, for an operator.

It only watches; no controller uses it, so that none commands anything else for it.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

from fulmar_core.estimators.actuator_health.applied import AppliedHistory
from fulmar_core.estimators.actuator_health.beliefs import NO_EFFECT, Beliefs, said_dead
from fulmar_core.estimators.actuator_health.fault_bank import FaultBank
from fulmar_core.estimators.actuator_health.hypotheses import Kind
from fulmar_core.robots.robot import Robot
from fulmar_core.states.state import RigidBodyState

LEAST_S = 0.1  # between two measurements that are compared [s]
LONGEST_S = 1.0  # nothing is learned from a longer gap [s]
WAITING = 32  # measurements that may wait for what the actuators did
# What is named: what has been so likely for so long, as long as the best hypothesis explains what is measured.
LIKELY_DEAD, LIKELY_OPEN, LIKELY_OTHER = 0.97, 0.995, 0.95  # [-]
HOLD_S = 1.0  # [s]
DROPPED_BELOW = 0.5  # what is less likely than this is named no more [-]
WORST_FIT = 2.5  # mean square of the best hypothesis' errors, in standard deviations [-]
# A push beside an open valve that is as large as this share of what the valve itself does: then it is not that valve,
# or not it alone [-].
BESIDE = 0.45
# A push of so much of one actuator's thrust is about that of one [-].
ABOUT_ONE = (0.3, 1.5)
SOUND = 0.6  # chance that nothing is wrong from which nothing else is likely, nor suspected [-]


@dataclass(slots=True)
class Persistence:
    """Which of several beliefs have been likely for long enough; shapes (n,)."""

    likely: float
    since_s: np.ndarray
    named: np.ndarray

    @classmethod
    def of(cls, count: int, likely: float) -> Persistence:
        """Nothing is named yet."""
        return cls(likely, np.zeros(count), np.zeros(count, dtype=bool))

    def update(self, chance: np.ndarray, passed_s: float) -> None:
        """Take the chances of now; what is named stays so until it is unlikely."""
        self.since_s = np.where(chance > self.likely, self.since_s + passed_s, 0.0)
        self.named = (self.since_s >= HOLD_S - 1e-9) | (self.named & (chance > DROPPED_BELOW))


class FaultMonitor:
    """Compares what a robot's actuators applied with how it moves.

    Attributes:
        bank: Has the chances.
        beliefs: What is believed now.
        suspects: Names of actuators that are rather dead than not.
    """

    def __init__(self, robot: Robot, applied: AppliedHistory, *, control_hz: float, lockstep: bool) -> None:
        """Begin with sound actuators; the robot is one of `can_monitor`.

        Args:
            robot: The robot.
            applied: What its actuators did.
            control_hz: Rate of the measurements in lock step, and of commands [Hz].
            lockstep: Whether measurements come once for each command.
        """
        self.bank, self._applied = FaultBank(robot), applied
        self._names, self._noun = robot.actuators.names, "fan" if robot.actuators.kind == "fans" else "valve"
        response, odometry = robot.actuators.response, robot.sensors.odometry
        period_s = 1.0 / control_hz if lockstep else robot.timing.physics_dt
        seen_late_s = round(odometry.delay_s / period_s) * period_s
        self._late_ns = round(1e9 * (seen_late_s + response.latest_s + response.lag_s))
        self._least_ns = round(1e9 * (LEAST_S - 0.5 * robot.timing.physics_dt))
        every = self.bank.hypotheses.all
        self._kinds = {kind: np.array([each.kind is kind for each in every]) for kind in Kind}
        self._sound = int(np.flatnonzero(self._kinds[Kind.SOUND])[0])
        self._stuck = np.zeros((len(every), len(self._names)))
        for row, each in enumerate(every):
            self._stuck[row, list(each.stuck)] = 1.0
        rows = {(each.kind, each.stuck, each.level, each.for_long): row for row, each in enumerate(every)}
        #: For each single actuator that is dead, the row in which it is open, and the other way round; -1: none.
        self._twin = np.full(len(every), -1)
        for row, each in enumerate(every):
            if len(each.stuck) == 1:
                twin = (Kind.DEAD, each.stuck, 0.0, False)
                twin = (Kind.OPEN, each.stuck, 1.0, False) if each.kind is Kind.DEAD else twin
                self._twin[row] = rows[twin]
        self._force, self._moment = self.bank.one_actuator
        self.reset()

    def reset(self) -> None:
        """Forget everything: time or place jumped, or nothing carries the body."""
        self.bank.reset()
        self._waiting: deque[tuple[int, RigidBodyState]] = deque(maxlen=WAITING)
        self._last_ns = -1
        count = len(self._names)
        self._dead, self._open = Persistence.of(count, LIKELY_DEAD), Persistence.of(count, LIKELY_OPEN)
        self._others = Persistence.of(2, LIKELY_OTHER)  # a push from nobody, and no effect of any command
        self.beliefs = Beliefs()
        self.suspects: tuple[str, ...] = ()
        self._nothing = True  # is named, or has begun to be likely

    def _suspects(self) -> tuple[str, ...]:
        dead = (self.bank.chance * self._kinds[Kind.DEAD]) @ self._stuck
        return tuple(name for name, chance in zip(self._names, dead, strict=True) if chance >= DROPPED_BELOW)

    def take(self, state: RigidBodyState, stamp_ns: int) -> None:
        """Take a measurement; it is used once it is known what the actuators did until then."""
        newest_ns = self._waiting[-1][0] if self._waiting else self._last_ns
        if newest_ns >= 0 and 0 <= stamp_ns - newest_ns < self._least_ns:
            return
        if stamp_ns < newest_ns:
            self.reset()
        self._waiting.append((stamp_ns, state))
        while self._waiting and self._applied.newest_ns >= self._waiting[0][0] - self._late_ns:
            self._use(*self._waiting.popleft())

    def _use(self, stamp_ns: int, state: RigidBodyState) -> None:
        passed_ns, before_ns = stamp_ns - self._last_ns, self._last_ns
        self._last_ns = stamp_ns
        applied = None
        if before_ns >= 0 and passed_ns <= LONGEST_S * 1e9:
            applied = self._applied.between(before_ns - self._late_ns, stamp_ns - self._late_ns)
        self.bank.take(state, applied)
        sound = self.bank.chance[self._sound] > SOUND
        self.suspects = () if sound else self._suspects()
        if applied is not None and not (sound and self._nothing):
            self._follow(1e-9 * passed_ns)

    def _follow(self, passed_s: float) -> None:
        """Name what is likely."""
        chance = self.bank.chance * (self.bank.misfit <= WORST_FIT)
        dead, opened = chance * self._kinds[Kind.DEAD], chance * self._kinds[Kind.OPEN]
        explained = self._explained()
        self._dead.update((dead * explained) @ self._stuck, passed_s)
        self._open.update((opened * explained) @ self._stuck, passed_s)
        # That something pushes is sure where the chances of several open valves add up to it.
        pushed = float(chance[self._kinds[Kind.PUSHED]].sum()) * self._about_one() + float(opened.sum())
        powerless = float(chance[self._kinds[Kind.POWERLESS]].sum())
        self._others.update(np.array([pushed, powerless]), passed_s)
        self.beliefs = self._beliefs()
        self._nothing = not any(
            part.since_s.any() or part.named.any() for part in (self._dead, self._open, self._others)
        )

    def _explained(self) -> np.ndarray:
        """For each hypothesis, whether little pushes beside what it says, shape (hypotheses,).

        A valve that is dead and the same valve stuck open differ by a constant push. What needs less of it is believed.
        """
        best = int(np.argmax(self.bank.chance))
        found = np.ones(len(self.bank.chance))
        twin = int(self._twin[best])
        if twin >= 0:
            push = self.bank.push(best)
            beside = max(np.linalg.norm(push[:3]) / self._force, np.linalg.norm(push[3:]) / self._moment)
            alone = self._kinds[Kind.DEAD][best] or beside < BESIDE
            found[best] = float(alone and self.bank.needs_less_push(best, twin))
        return found

    def _about_one(self) -> float:
        """Whether a push from outside is about that of one actuator: 1 or 0."""
        push = self.bank.push(int(np.flatnonzero(self._kinds[Kind.PUSHED])[0]))
        low, high = ABOUT_ONE
        force = np.linalg.norm(push[:3]) / self._force
        return float(low < force < high)

    def _beliefs(self) -> Beliefs:
        dead, opened = (
            tuple(name for name, named in zip(self._names, part.named, strict=True) if named)
            for part in (self._dead, self._open)
        )
        words = [f"{self._noun} {name} is stuck open" for name in opened]
        words += [said_dead(self._noun, name) for name in dead]
        pushed, powerless = self._others.named
        if powerless:
            words.append(NO_EFFECT)
        if pushed and not opened:
            words.append(
                f"a push that nobody commanded, about the thrust of one {self._noun}; which {self._noun} is not known"
            )
        return Beliefs(dead, tuple(words), opened, tuple(words))
