"""The one shape of filters that can go back, and the kinds of events that they take."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

import numpy as np

IMU, POSE, ATTITUDE = range(
    3
)  # kinds of events; of one time the inertial reading first, which moves the robot there


Placed = tuple[np.ndarray, np.ndarray]  # position in the world (3,) [m], quaternion x, y, z, w


class Filter(ABC):
    """A filter that can go back; values of events are of its own types."""

    @abstractmethod
    def move_on(self, seconds: float, inertial: Any) -> None:
        """Predict by a time step [s] from an inertial reading; None: there is none."""

    @abstractmethod
    def correct(self, kind: int, value: Any) -> None:
        """Correct by an event."""

    @abstractmethod
    def distance2(self, kind: int, value: Any) -> float:
        """Squared Mahalanobis distance of an event from what is expected [-]."""

    @abstractmethod
    def snapshot(self) -> Any:
        """Everything that it believes, to go back to."""

    @abstractmethod
    def restore(self, snapshot: Any) -> None:
        """Go back."""

    @abstractmethod
    def speed_std(self) -> float:
        """Largest standard deviation of the velocity's components [m/s]."""

    @abstractmethod
    def rate_std(self) -> float:
        """Largest standard deviation of the turn rate's components [rad/s]."""

    @abstractmethod
    def placed(self) -> Placed:
        """Where the body is believed to be."""

    @abstractmethod
    def biases(self) -> tuple[float, float]:
        """How large the biases of accelerometer [m/s²] and gyroscope [rad/s] are believed to be."""

    @abstractmethod
    def keep_biases(self, other: Any) -> None:
        """Believe of the inertial unit what another filter of its class does."""

    @abstractmethod
    def velocity(self) -> np.ndarray:
        """In the world [m/s]."""

    @abstractmethod
    def turn_rate(self) -> float:
        """Its size [rad/s]."""

    @abstractmethod
    def separation(self, other: Any) -> tuple[np.ndarray, np.ndarray]:
        """Place, velocity and attitude less those of another filter of its class, and the other's covariance.

        Returns:
            Errors along each axis [m, m/s, rad], and their covariance.
        """
