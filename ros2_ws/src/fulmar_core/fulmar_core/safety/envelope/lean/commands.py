"""What actuators do over a rollout: the command before, one step of the controller's, then that of the stop."""

from __future__ import annotations

import numpy as np

from fulmar_core.robots.actuators.response import Response


def done_at(
    times: np.ndarray,
    late_s: np.ndarray,
    commands: tuple[np.ndarray, np.ndarray, np.ndarray],
    response: Response,
    dt: float,
) -> np.ndarray:
    """What actuators do at some times, without a lag.

    Args:
        times: Shape (steps,) [s].
        late_s: Of the commands, shape (k,) [s].
        commands: The one before, that of the controller, which a slew limit lets them reach within its step, and that
            of the stop, each of shape (n, m).
        response: With the slew limit, if there is one.
        dt: Time of a control step [s].

    Returns:
        Shape (steps, n, k, m).
    """
    before, now, rest = (command[None, :, None, :] for command in commands)
    since = (times[:, None] - late_s)[:, None, :, None]
    if not response.slew:
        return np.where(since < 0.0, before, np.where(since < dt, now, rest))
    most = np.asarray(response.slew) * np.maximum(since - dt, 0.0)
    return np.asarray(
        before + (now - before) * np.clip(since / dt, 0.0, 1.0) + np.clip(rest - now, -most, most)
    )
