"""A simulated platform on its air bearing: without air, or while a hand holds it, it does not move."""

from __future__ import annotations

import threading
from dataclasses import replace
from typing import Protocol

import numpy as np

from fulmar_core.simulation.backend import Backend, Sample
from fulmar_core.simulation.disturbed import CanPlace, CanPush
from fulmar_core.simulation.episode import Episode
from fulmar_core.states.state import RigidBodyState
from fulmar_core.worlds.scenario import Scenario, bearing_late_s


class CanStand(Backend, Protocol):
    """A simulator whose body can be kept where it is."""

    def stand(self, ticks: int = 1, *, begins: int | None = None) -> Sample:
        """Let time pass for a body that nothing moves.

        Args:
            ticks: Number of physics steps, >= 1.
            begins: As in `Backend.step`.

        Returns:
            Sample at their end; the body is at rest.
        """
        ...


class OnAir:
    """A simulator with an `AirBearing`, whose valve is open from the start.

    Air carries the body a while after the valve has opened, as the scenario says. Until then the other valves stay
    closed, as the drivers of real platforms keep them.
    """

    def __init__(self, backend: CanStand, scenario: Scenario) -> None:
        self.robot, self._backend, self._scenario = backend.robot, backend, scenario
        self._safe = self.robot.actuators.safe_command
        self._lock = threading.Lock()
        self._open = True  # the bearing's valve
        self._late_s = scenario.bearing_late_s[0]
        self._open_s = 0.0  # since the valve was opened
        self._carried_s = 0.0  # since the start, on air

    def reset(self, episode: Episode, *, seed: int, number: int = 0) -> Sample:
        """Begin anew; see `Backend.reset`."""
        with self._lock:
            self._late_s = bearing_late_s(self._scenario, seed=seed, number=number)
            self._open_s = self._carried_s = 0.0
        return self._backend.reset(episode, seed=seed, number=number)

    def step(self, command: np.ndarray, ticks: int = 1, *, begins: int | None = None) -> Sample:
        """Apply a command, or closed valves while the bearing is off; see `Backend.step`."""
        on, (grip_s, release_s) = self.bearing_on, self._scenario.held_s
        applied = np.asarray(command, dtype=float) if on else self._safe
        held = grip_s <= self._carried_s < release_s
        if on and not held:
            sample = self._backend.step(applied, ticks, begins=begins)
        else:
            sample = self._backend.stand(ticks, begins=begins)
        seconds = (ticks + sample.more_ticks) * self.robot.timing.physics_dt
        with self._lock:
            self._carried_s += seconds if on else 0.0
            self._open_s += seconds if self._open else 0.0
        return replace(sample, applied=applied)

    def push(self, force: tuple[float, ...] | None) -> None:
        """See `CanPush.push`; a body that stands is not moved."""
        if isinstance(self._backend, CanPush):
            self._backend.push(force)

    def place(self, state: RigidBodyState) -> None:
        """See `CanPlace.place`; also without air."""
        if isinstance(self._backend, CanPlace):
            self._backend.place(state)

    def make_safe(self) -> None:
        """See `Backend.make_safe`; the bearing stays as it is."""
        self._backend.make_safe()

    def close(self) -> None:
        """See `Backend.close`."""
        self._backend.close()

    @property
    def bearing_on(self) -> bool:
        """See `AirBearing`."""
        with self._lock:
            return self._open and self._open_s >= self._late_s - 1e-9

    def set_bearing(self, on: bool) -> str:
        """See `AirBearing`."""
        with self._lock:
            if not on:
                self._open_s = 0.0
            self._open = on
        return ""
