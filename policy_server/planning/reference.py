"""A drive as a controller follows it: states at its own rate, and gains that answer deviations from them."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

from policy_server.planning.boat import MOTION, Boat
from policy_server.planning.program import Drive
from policy_server.planning.settings import PlannerSettings

_LEAST_COST = 0.1  # of commands beside the plan's; keeps the Riccati equation well posed


@dataclass(frozen=True)
class Reference:
    """What to be at each control step, and what to do about being something else."""

    states: np.ndarray  # (steps + 1, size), as of `boat`
    gains: np.ndarray  # (steps, n, size) change of command for each deviation, as a share of slew
    changes: np.ndarray  # (steps, n) of the commands themselves, as a share of slew
    arrivals: np.ndarray  # (waypoints,) control step by which each is passed

    def then(self, other: Reference) -> Reference:
        """This reference with another one that begins where it ends."""
        turns = np.round((self.states[-1, 2] - other.states[0, 2]) / (2.0 * np.pi))
        states = other.states[1:] + 2.0 * np.pi * turns * (np.arange(other.states.shape[1]) == 2)
        return Reference(
            np.concatenate((self.states, states)),
            np.concatenate((self.gains, other.gains)),
            np.concatenate((self.changes, other.changes)),
            np.concatenate((self.arrivals, other.arrivals + len(self.changes))),
        )


class Follower:
    """Makes references of drives: a linear-quadratic regulator about each (Anderson and Moore 1990, §2.4)."""

    def __init__(self, boat: Boat, settings: PlannerSettings, dt: float) -> None:
        """For one boat and one control period [s]."""
        self._boat, self._dt = boat, dt
        n = len(boat.slew)
        costs = [settings.position] * 2 + [settings.heading] + [settings.motion] * 3 + [_LEAST_COST] * n
        self._deviation, self._change = np.diag(costs), settings.change * np.eye(n)
        step = boat.step(dt)
        state, share = ca.SX.sym("state", boat.size), ca.SX.sym("share", n)
        after = step(state, share * boat.slew)
        self._slopes = ca.Function(
            "slopes", [state, share], [ca.jacobian(after, state), ca.jacobian(after, share)]
        )

    def of_samples(self, states: np.ndarray, arrivals: np.ndarray) -> Reference:
        """The reference through states a control step apart.

        Args:
            states: Shape (steps + 1, size), as of `boat`.
            arrivals: Control step by which each waypoint is passed.
        """
        count, size, n = len(states) - 1, self._boat.size, len(self._boat.slew)
        states = self._boat.useful(states)
        changes = np.clip(np.diff(states[:, MOTION:], axis=0) / (self._dt * self._boat.slew), -1.0, 1.0)
        if not count:
            return Reference(states, np.zeros((0, n, size)), changes, arrivals)
        flat = [np.asarray(each) for each in self._slopes.map(count)(states[:-1].T, changes.T)]
        a, b = (each.reshape(size, count, -1).transpose(1, 0, 2) for each in flat)
        gains, left = np.zeros((count, n, size)), self._deviation
        for k in range(count - 1, -1, -1):
            weighed = b[k].T @ left
            gains[k] = np.linalg.solve(self._change + weighed @ b[k], weighed @ a[k])
            left = self._deviation + a[k].T @ left @ (a[k] - b[k] @ gains[k])
        return Reference(states, gains, changes, arrivals)

    def of_drive(self, drive: Drive) -> Reference:
        """The reference of a plan, by the cubics that its collocation stands for."""
        times = drive.times
        at = self._dt * np.arange(int(times[-1] / self._dt) + 1)
        i = np.clip(np.searchsorted(times, at, side="right") - 1, 0, len(times) - 2)
        h = (times[i + 1] - times[i])[:, None]
        z = (at - times[i])[:, None] / h
        rates = np.asarray(self._boat.pace.map(len(times))(drive.states.T)).T
        a, b = drive.states[i], drive.states[i + 1]
        states = a + z * (b - a)
        states[:, :MOTION] = (
            (1.0 + 2.0 * z) * (1.0 - z) ** 2 * a[:, :MOTION]
            + z * (1.0 - z) ** 2 * h * rates[i]
            + z * z * (3.0 - 2.0 * z) * b[:, :MOTION]
            - z * z * (1.0 - z) * h * rates[i + 1]
        )
        return self.of_samples(states, np.ceil(drive.arrivals / self._dt).astype(int))
