"""The observation vector of a controller, defined once for training, evaluation and the robot."""

from __future__ import annotations

import numpy as np
from array_api_compat import device

from fulmar_core.robots.robot import Robot
from fulmar_core.robots.sensors.fuel import NAME as FUEL
from fulmar_core.states.arrays import array_namespace, clip, is_numpy, is_single
from fulmar_core.states.rotation import Array
from fulmar_core.states.state import State
from fulmar_core.tasks import Task
from fulmar_core.tasks.goal import Goal

FUEL_TERM = "fuel_share"


class Observer:
    """A task's terms, and the robot's own where its actuators take time to follow, or its fuel is observed.

    Attributes:
        names: Of the terms, in order.
        readings: Sensors that it needs beside the state, see `Controller.readings`.
    """

    def __init__(self, robot: Robot, task: Task) -> None:
        self._task = task
        self._remembers = robot.actuators.remembers
        self._scale = robot.actuators.scale
        own = tuple(f"previous_{name}" for name in robot.actuators.names) if self._remembers else ()
        gauge = robot.sensors.specs.get(FUEL)
        self.sees_fuel = gauge is not None and gauge.observed
        self.readings = (FUEL,) if self.sees_fuel else ()
        self.names: tuple[str, ...] = (
            *task.observation_names,
            *own,
            *([FUEL_TERM] if self.sees_fuel else []),
        )

    def __call__(self, state: State, goal: Goal, previous_command: Array, fuel: Array | None = None) -> Array:
        """Observe.

        Args:
            state: Measured state, shapes (...,).
            goal: Goal of the same leading shape.
            previous_command: What was last commanded, after every limit, shape (..., m).
            fuel: Share of the full tank that is left, shape (...,); None: it is full, as before the first reading.

        Returns:
            Terms in the order of `names`, shape (..., n).
        """
        if self._task.observes_numbers and is_single(state.like):
            own = shares(previous_command, self._scale)[0].tolist() if self._remembers else []
            left = [1.0 if fuel is None else float(fuel[0])] if self.sees_fuel else []
            return np.array([[*self._task.observe(state.in_numbers(), goal), *own, *left]])
        terms = self._task.observe(state, goal)
        like = state.columns()[0]
        xp = array_namespace(like)
        shape, place = like.shape, device(like)
        columns = [
            term
            if getattr(term, "shape", None) == shape
            else xp.broadcast_to(xp.asarray(term, device=place), shape)
            for term in terms
        ]
        if self._remembers:
            share = shares(previous_command, self._scale)
            columns += [share[..., i] for i in range(share.shape[-1])]
        if self.sees_fuel:
            left = xp.ones_like(like) if fuel is None else xp.asarray(fuel, dtype=like.dtype, device=place)
            columns.append(xp.broadcast_to(left, shape))
        # Stacked in front and turned about: each column is written in one piece.
        stacked = xp.stack(columns, axis=0)
        return stacked.T if len(shape) == 1 else xp.moveaxis(stacked, 0, -1)


def slewed(command: Array, previous: Array, robot: Robot, control_dt: float) -> Array:
    """A command that the actuators reach within one control step.

    With it the previous command says what the actuators do now, so that a controller needs no other sensor for it.

    Args:
        command: Within the actuators' limits, shape (..., n).
        previous: The one before, same shape.
        robot: Says how fast its actuators follow.
        control_dt: Time of one control step [s].
    """
    if not robot.actuators.response.slew:
        return command
    slew = robot.actuators.response.slew
    limit: Array = control_dt * slew[0]
    if any(rate != slew[0] for rate in slew):
        most = control_dt * np.asarray(slew)
        limit = array_namespace(command).asarray(most, dtype=command.dtype, device=device(command))
    return robot.actuators.limited(previous + clip(command - previous, -limit, limit))


def shares(command: Array, scale: np.ndarray) -> Array:
    """Commands as shares of the largest ones, shapes (..., n), (n,) and (..., n)."""
    if is_numpy(command) and (scale == 1.0).all():
        return command
    return command / array_namespace(command).asarray(scale, dtype=command.dtype, device=device(command))
