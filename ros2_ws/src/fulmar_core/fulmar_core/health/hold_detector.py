"""Whether something keeps a body from moving: a hand, a cable, or the floor under an air bearing without air.

A body that does not move although its valves open is explained by dead valves and pushes, too, so a bank of hypotheses
about those learns nonsense while a person holds the robot. This is the test against it: a cumulative sum (Page 1954,
"Continuous inspection schemes") of how much better standing still explains the measurements than the whole bank does.
Up to two dead valves explain a standstill as well; what they cannot explain is that none of several valves has an
effect.
"""

from __future__ import annotations

import numpy as np

from fulmar_core.health.trust import Suspicion

ALLOWANCE = 1.0  # evidence that is forgotten in one second: errors of the model add up slowly [-]
MOST = 6.0  # evidence of one measurement at most, as log-likelihood [-]
OF_THE_MEAN = np.array(
    [1, 1, 1, 0, 0, 0]
)  # of pose and velocity, what is compared with a mean of measurements
RELEASE = 6.0  # evidence for motion that ends a standstill: a third of a second of full thrust [-]


class HoldDetector:
    """Evidence that bodies are held, for one or for many at once; arrays of shape (...,)."""

    def __init__(self, suspicion: Suspicion, shape: tuple[int, ...]) -> None:
        """Begin with bodies that are free.

        Args:
            suspicion: How well is measured, and how much evidence it takes.
            shape: Of the bodies.
        """
        s = suspicion
        self._spread = np.array([s.position, s.position, s.heading, s.velocity, s.velocity, s.yaw_rate])
        self._limit = s.held
        self._evidence = np.zeros(shape)
        self._place = np.zeros((*shape, 3))  # mean pose since the evidence began [m, m, rad]
        self._count = np.zeros(shape)  # measurements in it
        self.held = np.zeros(shape, dtype=bool)

    @property
    def innocent(self) -> np.ndarray:
        """Where nothing speaks for a hold."""
        return np.asarray((self._evidence <= 0.0) & ~self.held)

    def look(self, seen: np.ndarray, surprise: np.ndarray, thrust: np.ndarray, dt: float) -> None:
        """Take a measurement.

        Args:
            seen: Pose, velocity and turn rate, shape (..., 6).
            surprise: Of the hypotheses for a free body, all together: negative log-likelihood of the measurement.
            thrust: Whether valves were open since the last measurement; without, a standstill shows nothing.
            dt: How long that was [s].
        """
        begun = self._count > 0
        off = seen.copy()
        off[..., :3] -= np.where(begun[..., None], self._place, seen[..., :3])
        off[..., 2] -= 2.0 * np.pi * (off[..., 2] / (2.0 * np.pi)).round()
        spread = self._spread * np.sqrt(1.0 + 1.0 / np.maximum(self._count, 1.0))[..., None] ** OF_THE_MEAN
        still = 0.5 * ((off / spread) ** 2).sum(axis=-1)
        gain = np.where(thrust | (still > surprise), (surprise - still).clip(-MOST, MOST), 0.0)
        evidence = self._evidence + gain - np.where(self.held, 0.0, ALLOWANCE * dt)
        self._evidence = evidence.clip(0.0, np.where(self.held, RELEASE, np.inf))
        self.held = np.where(self.held, self._evidence > 0.0, self._evidence > self._limit)
        self._evidence = np.where(self.held, np.minimum(self._evidence, RELEASE), self._evidence)
        anew = self._evidence <= 0.0
        self._count = np.where(anew, 1.0, self._count + 1.0)
        step = off[..., :3] / self._count[..., None]
        self._place = np.where((anew | ~begun)[..., None], seen[..., :3], self._place + step)
