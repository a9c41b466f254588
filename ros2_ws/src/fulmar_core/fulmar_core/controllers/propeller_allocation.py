"""Which command each fixed propeller gets for a wanted push and turn, through its thrust curve backwards.

Propellers push less astern than ahead, so the pseudo-inverse (Fossen 2011, §12.3) alone asks for what they
cannot give. The turn is shrunk until no propeller has to push harder astern than it can, then the push is
lowered until none has to push harder ahead: a boat at full speed still steers, and one that turns on the spot
does not run away.
"""

from __future__ import annotations

import numpy as np

from fulmar_core.robots.actuators.propellers import Propellers


class PropellerAllocation:
    """Push and turn to commands."""

    def __init__(self, propellers: Propellers, *, least: float) -> None:
        """Invert the curve and the arrangement.

        Args:
            propellers: Two at least, side by side.
            least: Thrusts below are not worth a propeller's way through the dead band of its curve, > 0 [N].
        """
        arms = propellers.lever_arms
        matrix = np.stack((np.ones_like(arms), arms))
        if np.linalg.matrix_rank(matrix) < 2:
            raise ValueError("a boat needs propellers side by side, or it cannot be steered.")
        self._shares = np.linalg.pinv(matrix)
        curve = np.asarray(propellers.curve)
        commands = np.linspace(-1.0, 1.0, len(curve))
        self._astern, self._ahead, self._least = float(curve[0]), float(curve[-1]), least
        # Of commands with one thrust the one nearest to the dead band, which is reached soonest.
        rising = np.flatnonzero(np.diff(curve) > 0.0)
        backward, forward = rising[curve[rising] < 0.0], 1 + rising[curve[1 + rising] > 0.0]
        if not backward.size or not forward.size:
            raise ValueError("the propellers' curve must reach below and above 0.")
        self._dead = float(commands[backward[-1] + 1]), float(commands[forward[0] - 1])
        self._below = curve[backward], commands[backward]
        self._above = curve[forward], commands[forward]

    def best(self, push: np.ndarray, moment: np.ndarray, previous: np.ndarray) -> np.ndarray:
        """Commands for a wanted push and turn.

        Args:
            push: Wanted force ahead, shape (...,) [N].
            moment: Wanted yaw moment, shape (...,) [N·m].
            previous: Commands before, shape (..., n).

        Returns:
            Commands, shape (..., n).
        """
        astern, ahead = self._astern, self._ahead
        straight = np.clip(push[..., None] * self._shares[:, 0], astern, ahead)
        turn = moment[..., None] * self._shares[:, 1]
        strongest = 0.5 * (ahead - astern)
        largest = np.maximum(np.max(np.abs(turn), axis=-1, keepdims=True), 1e-9)
        turn = turn * np.minimum(1.0, strongest / largest)
        room = np.where(turn < 0.0, (straight - astern) / np.maximum(-turn, 1e-9), 1.0)
        turn = turn * np.minimum(1.0, np.min(room, axis=-1, keepdims=True))
        excess = np.max(straight + turn - ahead, axis=-1, keepdims=True)
        return self._command_for(straight + turn - np.maximum(excess, 0.0), previous)

    def _command_for(self, thrust: np.ndarray, previous: np.ndarray) -> np.ndarray:
        """The curve backwards; next to no thrust is had where the dead band is nearest."""
        low, high = self._dead
        below = np.interp(thrust, np.append(self._below[0], 0.0), np.append(self._below[1], low))
        above = np.interp(thrust, np.append(0.0, self._above[0]), np.append(high, self._above[1]))
        idle = np.clip(previous, low, high)
        return np.asarray(
            np.where(thrust <= -self._least, below, np.where(thrust >= self._least, above, idle))
        )
