"""What actuators did during each integration step, as a smooth function of their delay.

A simulator that switches at its ticks knows delays in whole ticks only, and a fit needs slopes. The mean over a step of
an input that is late by any amount has them: it is a difference of the input's integral at two times.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from fulmar_evaluation.identification.drives import Drive, Windows


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


def valve_wrench(
    windows: Windows, wrench: Callable[[np.ndarray], np.ndarray], delay: float, opening: float
) -> np.ndarray:
    """Wrench of valves in each step: they close at once and open later.

    Args:
        windows: With the commands of their runs.
        wrench: From commands, shape (k, m), to wrenches, shape (k, c).
        delay: Until a command acts [s].
        opening: Until a closed valve is open, beyond that [s].

    Returns:
        Shape (steps, c, w).
    """
    width = wrench(windows.drives[0].command[:1]).shape[1]
    held = np.zeros((windows.steps, width, len(windows)))
    for number, drive in enumerate(windows.drives):
        mine = windows.drive == number
        if mine.any():
            event_s, change = _valve_events(drive, wrench, delay, opening)
            held[:, :, mine] = mean_over_steps(
                event_s, change, windows.begin_s[mine], steps=windows.steps, dt=windows.dt
            )
    return held


def valve_inputs(
    windows: Windows, wrench: Callable[[np.ndarray], np.ndarray], values: Mapping[str, np.ndarray]
) -> np.ndarray:
    """The same for each copy of a fit, by its `delay` and `opening_delay`, shape (steps, c, copies, w)."""
    return for_each_copy(
        lambda delay, opening: valve_wrench(windows, wrench, delay, opening),
        values["delay"],
        values["opening_delay"],
    )


def _valve_events(
    drive: Drive, wrench: Callable[[np.ndarray], np.ndarray], delay: float, opening: float
) -> tuple[np.ndarray, np.ndarray]:
    """When the wrench of valves changes, and by how much."""
    command = drive.command
    before = np.concatenate((np.zeros((1, command.shape[1])), command[:-1]))
    meanwhile = wrench(np.minimum(before, command))
    closing = meanwhile - wrench(before)
    opened = wrench(command) - meanwhile
    times = np.concatenate((drive.switch_s + delay, drive.switch_s + delay + opening))
    return times, np.concatenate((closing, opened))


def late_events(switch_s: np.ndarray, command: np.ndarray, delay: float) -> tuple[np.ndarray, np.ndarray]:
    """When commands take effect [s], shape (k,), and by how much they change, shape (k, m)."""
    return switch_s + delay, np.diff(command, axis=0, prepend=np.zeros((1, command.shape[1])))


def followed(windows: Windows, delay: float, slew: tuple[float, ...]) -> np.ndarray:
    """What actuators do in each step, which follow late commands no faster than they can.

    A slewed input is a ramp and has slopes by itself: a step gets what is reached at its end, as in a simulator.

    Args:
        windows: With the commands of their runs.
        delay: Until a command acts [s].
        slew: Fastest change of each actuator [per s]; empty: at once.

    Returns:
        Shape (steps, m, w).
    """
    parts: list[np.ndarray] = []
    for number, drive in enumerate(windows.drives):
        begin_s = windows.begin_s[windows.drive == number]
        if not len(begin_s):
            continue
        if not slew:
            event_s, change = late_events(drive.switch_s, drive.command, delay)
            parts.append(mean_over_steps(event_s, change, begin_s, steps=windows.steps, dt=windows.dt))
            continue
        ends = begin_s[None, :] + windows.dt * np.arange(1, windows.steps + 1)[:, None]
        ramps = [
            ramped(drive.switch_s, wanted, most) for wanted, most in zip(drive.command.T, slew, strict=True)
        ]
        parts.append(np.stack([np.interp(ends - delay, *ramp, left=0.0) for ramp in ramps], axis=1))
    return np.concatenate(parts, axis=2)


def ramped(switch_s: np.ndarray, wanted: np.ndarray, most: float) -> tuple[np.ndarray, np.ndarray]:
    """Corners of what an actuator does that follows steps as fast as it can, and begins at zero.

    Args:
        switch_s: When each step comes, increasing, shape (k,) [s].
        wanted: What it is to, shape (k,).
        most: Fastest change [per s].

    Returns:
        Times [s] and values of the corners, shapes (2 k,).
    """
    times, values = np.empty((2, len(switch_s))), np.empty((2, len(switch_s)))
    now = 0.0
    for k, (begin, target) in enumerate(zip(switch_s, wanted, strict=True)):
        left = switch_s[k + 1] - begin if k + 1 < len(switch_s) else np.inf
        takes = min(abs(target - now) / most, left)
        times[:, k], values[0, k] = (begin, begin + takes), now
        now = target if takes < left else now + np.copysign(most * takes, target - now)
        values[1, k] = now
    return times.T.ravel(), values.T.ravel()


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
