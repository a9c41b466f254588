"""Gas thrusters fed by one pressure line: on/off valves, or valves that open by degrees."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Literal

import numpy as np

from fulmar_core.robots.actuators.pushing import Mount, OneWay, Push
from fulmar_core.robots.actuators.response import Response
from fulmar_core.robots.actuators.tank import Tank
from fulmar_core.states.arrays import array_namespace, clip
from fulmar_core.states.attitude import Vector
from fulmar_core.states.rotation import Array

Row = tuple[tuple[float, list[int], list[int]], ...]  # a weight, and the nozzles it counts for and against


class Nozzle(Mount):
    """One valve with its nozzle."""

    WHAT = "nozzle"


@dataclass(frozen=True)
class Thrusters(OneWay):
    """A bank of valves; a command is 0 (closed) to 1 (open) for each, and nothing between for on/off valves.

    With a shared pressure line, n open valves give 1/n of the full thrust each (thesis §3.5.1;
    RANS `tasks/MFP2D_Virtual.py`), so opening more valves redirects the thrust but never adds to it. Valves that
    open by degrees share alike: once their openings add up to more than 1, each gives its part of the full thrust.
    """

    kind: Literal["thrusters"]
    thrust: float  # of one valve that is open alone [N]
    shared_pressure: bool
    nozzles: tuple[Nozzle, ...]
    continuous: bool = False  # valves open by degrees
    response: Response = Response()
    tank: Tank | None = None  # that feeds them; None: the supply never falls by itself

    opens_late = True
    calibrated = ("thrust", "opening_delay")

    def __post_init__(self) -> None:
        if self.thrust <= 0.0:
            raise ValueError("'thrust' must be greater than 0.")
        self.check_parts("nozzles")

    @property
    def binary(self) -> bool:
        """Whether valves know only open and closed."""
        return not self.continuous

    @functools.cached_property
    def pushes(self) -> tuple[Push, ...]:
        """Place and direction of each nozzle."""
        return tuple(nozzle.push for nozzle in self.nozzles)

    def limited(self, command: Array) -> Array:
        """Nearest command that the hardware can carry out.

        Args:
            command: Finite values, shape (..., n); anything above one half opens an on/off valve.

        Returns:
            Zeros and ones, or what lies between for valves that open by degrees, shape (..., n).
        """
        xp = array_namespace(command)
        if self.continuous:
            return clip(command, 0.0, 1.0)
        return xp.astype(command > 0.5, command.dtype)

    def thrusts(self, command: Array) -> Array:
        """Thrust of each valve.

        Args:
            command: Open (1) or closed (0), shape (..., n).

        Returns:
            Thrusts, shape (..., n) [N].
        """
        command = self._opening(command)
        if not self.shared_pressure:
            return self.thrust * command
        return self.thrust * command / clip(command.sum(-1)[..., None], 1.0, None)

    def total_thrust(self, applied: Array) -> Array:
        """Thrust of all nozzles together at the full pressure; see `Actuators.total_thrust`."""
        opened = self._opening(applied).sum(0)
        return self.thrust * (clip(opened, None, 1.0) if self.shared_pressure else opened)

    def _opening(self, applied: Array) -> Array:
        """How far valves are open: whatever errors add, a valve does not suck."""
        return clip(applied, 0.0, 1.0) if self.continuous else applied

    def planar_wrench(self, applied: Array, gain: Array) -> tuple[Array, Array, Array]:
        """Force and moment in the body's plane.

        Args:
            applied: How far each valve is open, shape (n, ...).
            gain: Factor on each thrust, same shape.

        Returns:
            Force ahead [N], to the left [N], and yaw moment [N·m], shapes (...,).
        """
        applied = self._opening(applied)
        thrust = applied * gain
        every: Row = ((1.0, list(range(len(self.nozzles))), []),)
        share = 1.0 / clip(_weighted(applied, every), 1.0, None) if self.shared_pressure else 1.0
        ahead, left, moment = (_weighted(thrust, row) * share for row in self._planar_rows)
        return ahead, left, moment

    def spatial_wrench(self, applied: Array, gain: Array) -> tuple[Vector, Vector]:
        """Force and torque in the body's frame; see `Pushing.spatial_wrench`."""
        applied = self._opening(applied)
        thrust = applied * gain
        if self.shared_pressure:
            every: Row = ((1.0, list(range(len(self.nozzles))), []),)
            thrust = thrust / clip(_weighted(applied, every), 1.0, None)
        x, y, z, roll, pitch, yaw = (_weighted(thrust, row) for row in self._spatial_rows)
        return (x, y, z), (roll, pitch, yaw)

    @functools.cached_property
    def _spatial_rows(self) -> tuple[Row, ...]:
        """Three forces and three torques as sums over the nozzles."""
        return tuple(_row(self.thrust * column) for column in self.wrench_per_newton.T)

    def mirrored(self) -> np.ndarray | None:
        """None: what policies learn of dead valves has no mirror image."""
        return None

    @functools.cached_property
    def _planar_rows(self) -> tuple[Row, ...]:
        """Force ahead, to the left and yaw moment as sums over the nozzles."""
        return tuple(_row(self.thrust * self.wrench_per_newton[:, column]) for column in (0, 1, 5))


def _row(weights: np.ndarray) -> Row:
    """Weights gathered by their size, so that equal ones are multiplied once."""
    sizes = np.unique(np.round(np.abs(weights), 12))
    return tuple(
        (
            float(size),
            np.flatnonzero(same & (weights > 0)).tolist(),
            np.flatnonzero(same & (weights < 0)).tolist(),
        )
        for size in sizes[sizes > 0.0]
        for same in [np.isclose(np.abs(weights), size, rtol=0.0, atol=1e-12)]
    )


def _weighted(thrust: Array, row: Row) -> Array:
    """Weighted sum over the first axis, in one order whatever the number of worlds: a BLAS would not promise that."""
    total: Array = None
    for size, plus, minus in row:
        part: Array = None
        for i in plus:
            part = thrust[i] if part is None else part + thrust[i]
        for i in minus:
            part = -thrust[i] if part is None else part - thrust[i]
        part = size * part
        total = part if total is None else total + part
    return array_namespace(thrust).zeros_like(thrust[0]) if total is None else total
