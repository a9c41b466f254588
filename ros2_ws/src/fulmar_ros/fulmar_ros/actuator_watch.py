"""Compares what was applied with how the body moved, measurement by measurement."""

from __future__ import annotations

from fulmar_core.health.applied import Applied, AppliedHistory
from fulmar_core.health.informer import Informer
from fulmar_core.health.thruster_health import Health
from fulmar_core.planar import planar_of
from fulmar_core.safety.input_gate import Measurement


class ActuatorWatch:
    """Matches states of the actuators with the motions between measurements, by their stamps.

    Attributes:
        history: Takes every message of `actuators/state`.
    """

    def __init__(self, pause_ns: int, hold_ns: int) -> None:
        """Begin with the next measurement.

        Args:
            pause_ns: After a longer gap between two measurements nothing is learned from the motion [ns].
            hold_ns: As of `AppliedHistory` [ns].
        """
        self._pause_ns = pause_ns
        self.history = AppliedHistory(hold_ns)
        self.forget()

    def forget(self) -> None:
        """Begin with the next measurement."""
        self._seen_ns = 0
        self._observed_ns = 0

    def lacks(self, stamp_ns: int, answered_ns: int) -> bool:
        """Whether the state of the actuators is still to come that a lock-stepped plant publishes before a measurement.

        Args:
            stamp_ns: Of the measurement [ns].
            answered_ns: Of the measurement before, which a command has answered; -1 without one [ns].
        """
        return 0 < stamp_ns - answered_ns <= self._pause_ns and self.history.newest_ns < answered_ns

    def since_observation(self, stamp_ns: int) -> Applied | None:
        """What was applied since the last call, until a measurement; None where it is not known.

        Args:
            stamp_ns: Of the measurement [ns].
        """
        before, self._observed_ns = self._observed_ns, stamp_ns
        return self.history.between(before, stamp_ns) if stamp_ns - before <= self._pause_ns else None

    def see(self, measurement: Measurement, informer: Informer, *, wanted: bool) -> Health | None:
        """Take the next measurement, or the same again.

        Args:
            measurement: Where the body is.
            informer: Of the controller whose turn it is.
            wanted: Whether others want to know.

        Returns:
            What is believed of the actuators, where that is wanted or the controller listens, and it is known.
        """
        passed_ns = measurement.stamp_ns - self._seen_ns
        if passed_ns == 0:  # by the clock, one measurement may serve twice
            return None
        if not 0 < passed_ns <= self._pause_ns:
            informer.reset()
        applied = self.history.between(self._seen_ns, measurement.stamp_ns)
        self._seen_ns = measurement.stamp_ns
        if not (wanted or informer.listens):
            self._seen_ns = 0  # a listener that comes later begins anew
            return None
        return informer.see(planar_of(measurement.state), applied, passed_ns / 1e9, wanted=wanted)
