"""What actuators did during each integration step, as a smooth function of their delay.

A simulator that switches at its ticks knows delays in whole ticks only, and a fit needs slopes. The mean over a step of
an input that is late by any amount has them: it is a difference of the input's integral at two times.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fulmar_core.identification.windows import Windows


def mean_over_steps(
    event_s: np.ndarray, change: np.ndarray, begin_s: np.ndarray, *, steps: int, dt: float
) -> np.ndarray:
    """Means of a piecewise constant input that is zero before its first event.

    Args:
        event_s: When it changes, in any order, shape (k,) [s].
        change: By how much, shape (k, c).
        begin_s: Beginnings of windows, shape (w,) [s].
        steps: Steps in each window.
        dt: Length of a step [s].

    Returns:
        Shape (steps, c, w).
    """
    order = np.argsort(event_s, kind="stable")
    knots, rates = event_s[order], np.cumsum(change[order], axis=0)
    edges = begin_s[None, :] + dt * np.arange(steps + 1)[:, None]  # (steps + 1, w)
    end = max(float(edges.max()), float(knots[-1])) + 1.0
    knots = np.append(knots, end)
    integral = np.concatenate(
        (np.zeros((1, rates.shape[1])), np.cumsum(rates * np.diff(knots)[:, None], axis=0))
    )
    at_edges = np.stack(
        [np.interp(edges, knots, integral[:, c], left=0.0) for c in range(integral.shape[1])], axis=1
    )
    return np.diff(at_edges, axis=0) / dt


def late_events(switch_s: np.ndarray, command: np.ndarray, delay: float) -> tuple[np.ndarray, np.ndarray]:
    """When commands take effect [s], shape (k,), and by how much they change, shape (k, m)."""
    return switch_s + delay, np.diff(command, axis=0, prepend=np.zeros((1, command.shape[1])))


def followed(windows: Windows, delay: float, slew: tuple[float, ...]) -> np.ndarray:
    """What actuators do in each step, which follow late commands no faster than they can.

    Args:
        windows: With the commands of their runs.
        delay: Until a command acts [s].
        slew: Fastest change of each actuator [per s]; empty: at once.

    Returns:
        Shape (steps, m, w).
    """
    parts: list[np.ndarray] = []
    for number, drive in enumerate(windows.drives):
        mine = windows.begin_s[windows.drive == number]
        if not len(mine):
            continue
        first = float(drive.time_s[0])
        begins = np.round((mine - first) / windows.dt).astype(int)
        whole = int(begins.max()) + windows.steps
        event_s, change = late_events(drive.switch_s, drive.command, delay)
        wanted = mean_over_steps(event_s, change, np.array([first]), steps=whole, dt=windows.dt)[:, :, 0]
        if slew:
            most, now = np.array(slew) * windows.dt, np.zeros(wanted.shape[1])
            for step in range(whole):
                now = now + np.clip(wanted[step] - now, -most, most)
                wanted[step] = now
        parts.append(np.stack([wanted[begin : begin + windows.steps] for begin in begins], axis=2))
    return np.concatenate(parts, axis=2)


def for_each_copy(make: Callable[..., np.ndarray], *columns: np.ndarray) -> np.ndarray:
    """Inputs of all copies of a fit; most copies share theirs, which is made once.

    Args:
        make: From one value of each column to an array (steps, c, w).
        columns: Shapes (copies, 1).

    Returns:
        Shape (steps, c, copies, w).
    """
    keys = [tuple(float(column[copy, 0]) for column in columns) for copy in range(len(columns[0]))]
    made = {key: make(*key) for key in dict.fromkeys(keys)}
    return np.stack([made[key] for key in keys], axis=2)
