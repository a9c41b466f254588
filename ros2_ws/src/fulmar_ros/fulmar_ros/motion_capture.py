"""Motion capture in simulation: poses of the measured odometry at a rate of their own, sent and stamped late."""

from __future__ import annotations

from collections import deque

from fulmar_core.state import RigidBodyState


class MotionCapture:
    """Not thread-safe; the plant's thread alone uses it."""

    def __init__(self, *, rate_hz: float = 0.0, late_s: float = 0.0) -> None:
        """Begin without a pose.

        Args:
            rate_hz: Captures; 0: with every measurement [Hz].
            late_s: From capture to sending; the stamp is that of the sending, as of sources that stamp on receipt [s].
        """
        self._period_ns = round(1e9 / rate_hz) if rate_hz else 0
        self._late_ns = round(1e9 * late_s)
        self._captured_ns: int | None = None
        self._under_way: deque[tuple[int, RigidBodyState]] = deque()

    def see(self, state: RigidBodyState, time_ns: int) -> list[tuple[int, RigidBodyState]]:
        """Note a measurement.

        Args:
            state: Measured.
            time_ns: When [ns].

        Returns:
            Poses to send now, each with its stamp [ns].
        """
        last = self._captured_ns
        if last is None or time_ns < last or time_ns - last >= self._period_ns:
            # On the beat of the captures, not of whoever asks.
            steps = (time_ns - last) // self._period_ns if last is not None and self._period_ns else 0
            self._captured_ns = last + steps * self._period_ns if last is not None and steps > 0 else time_ns
            self._under_way.append((time_ns + self._late_ns, state))
        due = []
        while self._under_way and self._under_way[0][0] <= time_ns:
            due.append(self._under_way.popleft())
        return due

    def close(self) -> None:
        """Nothing to end."""
