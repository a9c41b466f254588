"""Compares what was commanded with how the body moved, measurement by measurement."""

from __future__ import annotations

import numpy as np

from fulmar_core.health.informer import Informer
from fulmar_core.planar import planar_of
from fulmar_core.safety.input_gate import Measurement


class ActuatorWatch:
    """Feeds an informer with the motions between measurements."""

    def __init__(self, pause_ns: int) -> None:
        """Begin with the next measurement.

        Args:
            pause_ns: After a longer gap between two measurements nobody knows what moved the body [ns].
        """
        self._pause_ns = pause_ns
        self._seen_ns = 0

    def forget(self) -> None:
        """Begin with the next measurement."""
        self._seen_ns = 0

    def see(
        self, measurement: Measurement, command: np.ndarray, informer: Informer, *, wanted: bool
    ) -> np.ndarray | None:
        """Take the next measurement, or the same again.

        Args:
            measurement: Where the body is.
            command: What was applied since the one before, shape (m,).
            informer: Of the controller whose turn it is.
            wanted: Whether anybody wants to know.

        Returns:
            What is believed of each actuator, if that is wanted and known, shape (m,).
        """
        passed_ns = measurement.stamp_ns - self._seen_ns
        if passed_ns == 0:  # by the clock, one measurement may serve twice
            return None
        if not 0 < passed_ns <= self._pause_ns:
            informer.reset()
        self._seen_ns = measurement.stamp_ns
        if not (wanted or informer.listens):
            self._seen_ns = 0  # whoever comes to listen later begins anew
            return None
        health = informer.see(planar_of(measurement.state), command, passed_ns / 1e9, wanted=wanted)
        return health.effectiveness if health is not None and wanted else None
