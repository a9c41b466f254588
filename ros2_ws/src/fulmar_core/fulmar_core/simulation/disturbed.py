"""A simulator whose robot a person may disturb, and put elsewhere, while it runs."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Protocol, runtime_checkable

import numpy as np

from fulmar_core.config.errors import ConfigError
from fulmar_core.simulation.backend import AirBearing, Backend, Sample
from fulmar_core.simulation.disturbances import Disturbance, Disturbances
from fulmar_core.simulation.episode import Episode
from fulmar_core.states.state import RigidBodyState


@runtime_checkable
class CanPush(Protocol):
    """A simulator whose body can be pushed from outside."""

    def push(self, force: tuple[float, ...] | None) -> None:
        """Push at the centre of mass until the next call, in the world [N]; None: no more."""
        ...


@runtime_checkable
class CanPlace(Protocol):
    """A simulator whose body can be put elsewhere within an episode."""

    def place(self, state: RigidBodyState) -> None:
        """Put the body into a state, without a batch axis; actuators and the rest of the world go on as they were."""
        ...


class Disturbed:
    """A backend that passes everything on, changed by the disturbances that act.

    Attributes:
        moved: Called in the thread that steps, where the body was put elsewhere.
    """

    def __init__(self, backend: Backend) -> None:
        """Let nothing act on a simulator."""
        self.robot, self._backend = backend.robot, backend
        self._lock = threading.Lock()
        self._acting = Disturbances(backend.robot)
        self._next: Callable[[], object] | None = None  # what comes before the next step
        self.moved: Callable[[], None] = lambda: None

    def place(self, state: RigidBodyState) -> None:
        """Put the body into a state, without a batch axis, before the next step; from any thread.

        Raises:
            ConfigError: This simulator cannot do it.
        """
        backend = self._backend
        if not isinstance(backend, CanPlace):
            raise ConfigError(
                f"this simulator cannot put '{self.robot.name}' elsewhere. Use --backend mujoco or mock."
            )
        with self._lock:
            self._next = lambda: backend.place(state)

    def begin_anew(self, episode: Episode, *, seed: int) -> None:
        """Begin an episode before the next step, undisturbed; from any thread. Arguments as in `Backend.reset`."""
        with self._lock:
            self._next = lambda: self.reset(episode, seed=seed)

    def disturb(self, disturbance: Disturbance) -> None:
        """Let one act from the next step on; from any thread.

        Raises:
            ConfigError: This simulator cannot do it.
        """
        if disturbance.force and not isinstance(self._backend, CanPush):
            raise ConfigError(
                f"this simulator cannot push '{self.robot.name}'. Use --backend mujoco or mock."
            )
        with self._lock:
            self._acting.add(disturbance)

    @property
    def names(self) -> tuple[str, ...]:
        """Of the disturbances that act."""
        with self._lock:
            return self._acting.names

    def cuts(self, side: str) -> bool:
        """Whether the messages of one of `disturbances.SIDES` are lost now."""
        with self._lock:
            return self._acting.cuts(side)

    def reset(self, episode: Episode, *, seed: int, number: int = 0) -> Sample:
        """Begin anew, undisturbed; see `Backend.reset`."""
        with self._lock:
            self._acting = Disturbances(self.robot, seed)
            self._next = None
        if isinstance(self._backend, CanPush):
            self._backend.push(None)
        return self._backend.reset(episode, seed=seed, number=number)

    def step(self, command: np.ndarray, ticks: int = 1, *, begins: int | None = None) -> Sample:
        """See `Backend.step`."""
        self._take_next()
        with self._lock:
            acting = bool(self._acting.names)
            force, given = self._acting.force(), self._acting.commanded(command)
        if not acting:
            return self._backend.step(command, ticks, begins=begins)
        if isinstance(self._backend, CanPush):
            self._backend.push(force)
        sample = self._backend.step(given, ticks, begins=begins)
        with self._lock:
            sample = self._acting.measured(sample)
            self._acting.advance((ticks + sample.more_ticks) * self.robot.timing.physics_dt)
            over = self._acting.force() is None
        if over and isinstance(self._backend, CanPush):
            self._backend.push(None)
        return sample

    def _take_next(self) -> None:
        """Do what was asked for before this step."""
        with self._lock:
            change, self._next = self._next, None
        if change is not None:
            change()
            self.moved()

    def make_safe(self) -> None:
        """See `Backend.make_safe`."""
        self._backend.make_safe()

    def close(self) -> None:
        """See `Backend.close`."""
        self._backend.close()


class DisturbedOnAir(Disturbed):
    """The same of a simulator with an `AirBearing`."""

    def __init__(self, backend: Backend, bearing: AirBearing) -> None:
        """Pass on the bearing too."""
        super().__init__(backend)
        self._bearing = bearing

    @property
    def bearing_on(self) -> bool:
        """See `AirBearing`."""
        return self._bearing.bearing_on

    def set_bearing(self, on: bool) -> str:
        """See `AirBearing`."""
        return self._bearing.set_bearing(on)


def disturbed(backend: Backend) -> Disturbed:
    """A simulator that can be disturbed."""
    return DisturbedOnAir(backend, backend) if isinstance(backend, AirBearing) else Disturbed(backend)
