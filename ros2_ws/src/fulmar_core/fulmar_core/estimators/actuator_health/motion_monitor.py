"""Monitor of wheels and propellers whose work shows in the motion alone, for a controller that receives both."""

from __future__ import annotations

import numpy as np

from fulmar_core.estimators.actuator_health.applied import AppliedHistory
from fulmar_core.estimators.actuator_health.beliefs import Beliefs
from fulmar_core.estimators.actuator_health.feedback_check import MotionCheck
from fulmar_core.robots.robot import Robot
from fulmar_core.states.state import RigidBodyState

LONGEST_S = 1.0  # a longer gap between measurements teaches nothing [s]


class MotionMonitor:
    """Compares what a robot's actuators applied with the odometry that its controller receives.

    Attributes:
        beliefs: What is believed now.
    """

    def __init__(self, robot: Robot, applied: AppliedHistory) -> None:
        """Begin with sound actuators; `applied` is what they did."""
        self._check, self._applied = MotionCheck(robot), applied
        self.watches = self._check.watches
        self.reset()

    def reset(self) -> None:
        """Begin anew: time or place jumped."""
        self._check.reset()
        self._last: tuple[int, RigidBodyState] | None = None
        self._compared_ns: int | None = None
        self.beliefs = Beliefs()

    def take(self, state: RigidBodyState, stamp_ns: int) -> None:
        """Take a measurement; it is compared once the next one comes, when what was applied until then is known."""
        if self._last is not None and stamp_ns == self._last[0]:
            return
        if self._last is not None:
            self._compare(*self._last)
        self._last = stamp_ns, state

    def _compare(self, stamp_ns: int, state: RigidBodyState) -> None:
        since_ns, self._compared_ns = self._compared_ns, stamp_ns
        if since_ns is None or not since_ns < stamp_ns <= since_ns + 1e9 * LONGEST_S:
            self._check.reset()
            return
        applied = self._applied.between(since_ns, stamp_ns)
        if applied is None:
            self._check.reset()
            return
        count = len(applied.seconds)
        for number, (command, seconds) in enumerate(zip(applied.commands, applied.seconds, strict=True)):
            self._check.see(np.asarray(command), float(seconds), state if number == count - 1 else None)
        words = tuple(finding.words for finding in self._check.findings)
        dead = tuple(finding.part for finding in self._check.findings if finding.part)
        self.beliefs = Beliefs(dead, words, (), words)
