"""Fixed propellers with a thrust curve, as boats have them."""

from __future__ import annotations

import functools
import itertools
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from array_api_compat import device

from fulmar_core.robots.actuators.excitation import Excitation
from fulmar_core.robots.actuators.pushing import Push, Pushing, Vector3
from fulmar_core.robots.actuators.response import Response
from fulmar_core.states.arrays import array_namespace, clip, sum_of
from fulmar_core.states.rotation import Array


@dataclass(frozen=True)
class Propeller:
    """One propeller, in the body frame; it pushes along the body's x axis."""

    name: str
    position: Vector3  # where the force acts [m]


@dataclass(frozen=True)
class Propellers(Pushing):
    """A command is -1 (full astern) to 1 (full ahead) for each."""

    kind: Literal["propellers"]
    propellers: tuple[Propeller, ...]
    curve: tuple[float, ...]  # thrust at evenly spaced commands from -1 to 1 [N]
    response: Response = Response()

    excitation = Excitation(
        hold_s=6.0, foresight_s=2.0, calm=0.0
    )  # long enough to come up to speed, and to stop
    shared_pressure = False

    def __post_init__(self) -> None:
        self.check_parts("propellers")
        if len(self.curve) < 2 or list(self.curve) != sorted(self.curve):
            raise ValueError("'curve' needs at least two thrusts, none less than the one before.")
        if self.thrust(self.safe_command).any():
            raise ValueError("'curve' must be 0 in its middle: a command of 0 stops a propeller.")

    @functools.cached_property
    def pushes(self) -> tuple[Push, ...]:
        """Place of each propeller; all push ahead."""
        return tuple(Push(each.name, each.position, (1.0, 0.0, 0.0)) for each in self.propellers)

    @functools.cached_property
    def lever_arms(self) -> np.ndarray:
        """Yaw moment of 1 N ahead at each propeller, shape (n,) [m]."""
        return np.array([-propeller.position[1] for propeller in self.propellers])

    def limited(self, command: Array) -> Array:
        """Nearest command that the hardware can carry out, shape (..., n)."""
        return clip(command, -1.0, 1.0)

    def thrust(self, command: Array) -> Array:
        """Thrust by linear interpolation of the curve.

        Args:
            command: Within [-1, 1], any shape.

        Returns:
            Same shape [N].
        """
        xp = array_namespace(command)
        start, rise = _table(self.curve, xp, command.dtype, device(command))
        place = clip((command + 1.0) * (0.5 * (len(self.curve) - 1)), 0.0, len(self.curve) - 1.0)
        below = xp.floor(place)
        i = xp.astype(below, xp.int64)
        return start[i] + rise[i] * (place - below)

    def thrusts(self, command: Array) -> Array:
        """Thrust of each propeller, shape (..., n) [N]; see `Pushing.thrusts`."""
        return self.thrust(command)

    def by_hand(self, ahead: float, left: float, turn: float) -> np.ndarray | None:
        """Both ahead, and one of them more where the boat turns; see `Actuators.by_hand`."""
        return np.asarray(self.limited(np.asarray(ahead) + np.sign(self.lever_arms) * turn))

    def planar_wrench(self, applied: Array, gain: Array) -> tuple[Array, Array, Array]:
        """Force and moment in the body's plane.

        Args:
            applied: What each propeller does, shape (n, ...).
            gain: Factor on each thrust, same shape.

        Returns:
            Force ahead [N], to the left [N], and yaw moment [N·m], shapes (...,).
        """
        xp = array_namespace(applied)
        thrust = self.thrust(applied) * gain
        ahead = sum_of([thrust[i] for i in range(len(self.propellers))])
        moment = sum_of([float(arm) * thrust[i] for i, arm in enumerate(self.lever_arms)])
        return ahead, xp.zeros_like(ahead), moment


@functools.lru_cache(maxsize=16)
def _table(curve: tuple[float, ...], xp: Any, dtype: Any, where: Any) -> tuple[Array, Array]:
    """Thrust at each point of a curve, and what it rises by to the next, both of the curve's length."""
    rise = (*(high - low for low, high in itertools.pairwise(curve)), 0.0)
    return xp.asarray(curve, dtype=dtype, device=where), xp.asarray(rise, dtype=dtype, device=where)
