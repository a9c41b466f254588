"""Real time: step on absolute deadlines with the newest command, whatever the controller does."""

from __future__ import annotations

import threading
import time

import numpy as np

from fulmar_core.backend import Backend, Sample
from fulmar_core.process import PLANT_PRIORITY, take_priority
from fulmar_core.safety.actuator_guard import ActuatorGuard
from fulmar_ros.deadline import Deadlines
from fulmar_ros.plant_wires import PlantWires
from fulmar_ros.simulated_time import SimulatedTime
from fulmar_ros.wall_time import WallTime


class RealtimeLoop:
    """Steps a backend by the clock; the watchdog acts at every tick."""

    def __init__(
        self,
        backend: Backend,
        wires: PlantWires,
        guard: ActuatorGuard,
        clock: SimulatedTime | WallTime,
        *,
        rate: float,
    ) -> None:
        """Join the parts.

        Args:
            backend: A simulator or a robot.
            wires: Endpoints of the plant.
            guard: The last word on commands.
            clock: Stamps of the states.
            rate: Simulated seconds a wall-clock second, > 0.
        """
        self._backend, self._wires, self._guard, self._clock = backend, wires, guard, clock
        self._dt = backend.robot.timing.physics_dt
        self.period_s = self._dt / rate
        self.deadlines = Deadlines(self.period_s)
        self.ticks = 0
        self._ticked_ns: int | None = None

    def run(self, sample: Sample, ticks: int | None, stop: threading.Event) -> None:
        """Tick until the number of ticks is done or somebody stops it.

        Args:
            sample: First sample.
            ticks: How many; None for no end.
            stop: Set by another thread.
        """
        take_priority(PLANT_PRIORITY)
        self._ticked_ns = time.monotonic_ns()
        self._wires.publish_sample(sample, self._clock.now_ns)
        while (ticks is None or self.ticks < ticks) and self.deadlines.wait(stop):
            command, begun_ns = self._command(), self._clock.now_ns
            sample = self._backend.step(command)
            applied = command if sample.applied is None else sample.applied
            self._wires.publish_applied(applied, begun_ns)
            self._clock.advance(self._dt)
            self.ticks += 1
            self._ticked_ns = time.monotonic_ns()
            self._wires.publish_sample(sample, self._clock.now_ns)

    def since_tick_s(self, now_ns: int) -> float:
        """Time since the last finished step, 0 before the first [s].

        Args:
            now_ns: Monotonic clock [ns].
        """
        return 0.0 if self._ticked_ns is None else (now_ns - self._ticked_ns) / 1e9

    def _command(self) -> np.ndarray:
        with self._wires.lock:
            return self._guard.output(time.monotonic_ns())
