"""Golden vectors at both limits of every actuator, where another computer or an adapter most likely differs."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fulmar_core.loop.policy_bundle import Action, Golden

Infer = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray, np.ndarray]]
STRETCHES = (1.0, -1.0, 2.0, -2.0, 5.0, -5.0)  # of observations: farther away, faster, on the other side
CLOSE = 1e-3  # share of full command: tanh never reaches 1


def reached(commands: np.ndarray, scale: np.ndarray, action: Action) -> np.ndarray:
    """Limits of the actuators that some commands reach.

    Args:
        commands: Shape (k, n).
        scale: Full command of each actuator, shape (n,).
        action: Whether valves are closed (0) or open (1), or anything between full astern and full ahead.

    Returns:
        Shape (2, n): the lower and the upper limit.
    """
    return np.asarray(_at_limits(commands, scale, action).any(axis=1))


def _at_limits(commands: np.ndarray, scale: np.ndarray, action: Action) -> np.ndarray:
    """Which of its limits each command is at, shape (2, k, n)."""
    shares = commands / scale
    least = 0.0 if action == "on_off" else -1.0
    return np.stack((shares <= least + CLOSE, shares >= 1.0 - CLOSE))


def with_limits(golden: Golden, infer: Infer, scale: np.ndarray, action: Action) -> Golden:
    """Add vectors at limits that none is at, as far as stretched observations of the others lead there.

    Args:
        golden: Vectors of episodes.
        infer: What the network makes of observations and memories: commands, logits, next memories.
        scale: See `reached`.
        action: See `reached`.

    Returns:
        The same vectors, and behind them at most two for each actuator.
    """
    missing = ~reached(golden.commands, scale, action)
    if not missing.any():
        return golden
    seen = np.concatenate([np.float32(stretch) * golden.observations for stretch in STRETCHES])
    memory = np.tile(golden.memories, (len(STRETCHES), 1))
    commands, logits, after = infer(seen, memory)
    at = _at_limits(commands, scale, action)
    rows = [
        # The least stretched that is there, else the nearest.
        int(
            np.argmax(
                at[side, :, actuator] if at[side, :, actuator].any() else (2 * side - 1) * logits[:, actuator]
            )
        )
        for side, actuator in np.argwhere(missing)
    ]
    found = Golden(*(each[rows] for each in (seen, memory, commands, logits, after)))
    added = found.arrays()
    return Golden(**{name: np.concatenate((array, added[name])) for name, array in golden.arrays().items()})
