"""The reference of a path that is known ahead, as a craft can fly it: smoothed without lag, with its derivatives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fulmar_core.controllers.controller import Inputs
from fulmar_core.tasks.follow_reference import FollowReference, reference_of


@dataclass(frozen=True)
class Aim:
    """Where n craft shall be, how fast, and how that changes: to the left and up, each (n, 2)."""

    place: np.ndarray  # [m]
    rate: np.ndarray  # [m/s]
    bend: np.ndarray  # [m/s²]


class SmoothReference:
    """References of n craft, smoothed over some time to either side by a raised cosine.

    A step of the climb rate makes the elevator push a craft down before it rises; at one metre that ends in the water.
    """

    def __init__(self, task: FollowReference, *, over_s: float, dt: float) -> None:
        """Prepare; `over_s`: half of the time that is smoothed over; `dt`: of a control step [s]."""
        self._spacing, self._dt = task.spacing_s, dt
        half = max(1, round(over_s / dt))
        window = 1.0 + np.cos(np.pi * np.arange(-half, half + 1) / (half + 1))
        self._window, self._half = window / window.sum(), half
        self.reset()

    def reset(self) -> None:
        """Forget the paths."""
        self._targets: np.ndarray | None = None

    def at(self, inputs: Inputs) -> Aim:
        """The aim of now; `inputs` as for a controller."""
        return self.ahead(inputs, (0.0,))[0]

    def ahead(self, inputs: Inputs, times_s: Sequence[float]) -> list[Aim]:
        """The aims after some times from now [s]; `inputs` as for a controller."""
        targets = np.asarray(inputs.goal.targets, dtype=float)
        now = np.asarray(reference_of(inputs.goal), dtype=float)
        if targets.shape[-2] == 1:
            still = np.zeros((len(now), 2))
            return [Aim(now[:, 2:4], now[:, 5:7], still)] * len(times_s)
        if self._targets is None or self._targets.shape != targets.shape or (self._targets != targets).any():
            self._targets = targets.copy()
            self._paths = self._smoothed(targets[..., 1:3])
        last, each, found = self._paths[0].shape[1] - 1, np.arange(len(now)), []
        for time in times_s:
            step = np.clip(np.round((now[:, 0] + time) / self._dt).astype(int), 0, last)
            found.append(Aim(*(path[each, step] for path in self._paths)))
        return found

    def _smoothed(self, places: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Place, rate and bend at every control step, each (n, steps, 2)."""
        known = self._spacing * np.arange(places.shape[1])
        times = self._dt * np.arange(round(known[-1] / self._dt) + 1)
        found = np.empty((len(places), len(times), 2))
        for i, craft in enumerate(places):
            if i and np.array_equal(craft, places[i - 1]):
                found[i] = found[i - 1]
                continue
            for axis in range(2):
                line = np.interp(times, known, craft[:, axis])
                padded = np.concatenate((np.full(self._half, line[0]), line, np.full(self._half, line[-1])))
                found[i, :, axis] = np.convolve(padded, self._window, mode="valid")
        rate = np.asarray(np.gradient(found, self._dt, axis=1))
        return found, rate, np.asarray(np.gradient(rate, self._dt, axis=1))
