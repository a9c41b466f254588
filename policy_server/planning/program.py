"""The quickest drive of a boat along waypoints as a nonlinear program.

Direct collocation by Hermite and Simpson (Hargraves and Paris 1987; Kelly 2017, "An Introduction to Trajectory
Optimization", §4): every leg has as many nodes, and its time is a variable. Commands change evenly between nodes, no
faster than they slew. IPOPT by CasADi finds a drive that no small change makes quicker; which one, hangs on the guess.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from policy_server.planning.boat import MOTION, Boat

_LEG_S = (0.05, 20.0)  # of any leg [s]
_STRAY = 10.0  # cost of passing a waypoint farther away than wanted, beside that of time [s/m]
_ROUGH = 1e-4  # cost of commands that change as fast as they can, beside that of time [-]
_IPOPT = {
    "print_level": 0,
    "sb": "yes",
    "max_iter": 200,
    "mu_init": 3e-3,  # the guess is good: begin near it
    "bound_push": 1e-4,
    "bound_frac": 1e-4,
    "slack_bound_push": 1e-4,
    "slack_bound_frac": 1e-4,
    "tol": 1e-3,
    "acceptable_tol": 1e-2,
    "acceptable_iter": 8,
}


@dataclass(frozen=True)
class Drive:
    """States at the nodes of a course's legs; the last node of a leg is the first of the next."""

    states: np.ndarray  # (legs * nodes + 1, size), as of `boat`
    leg_s: np.ndarray  # (legs,) time of each [s]

    @property
    def nodes(self) -> int:
        """Nodes of a leg."""
        return (len(self.states) - 1) // len(self.leg_s)

    @property
    def times(self) -> np.ndarray:
        """When each node is passed, shape (legs * nodes + 1,) [s]."""
        steps = np.repeat(self.leg_s / self.nodes, self.nodes)
        return np.concatenate(([0.0], np.cumsum(steps)))

    @property
    def arrivals(self) -> np.ndarray:
        """When each waypoint is passed, shape (legs,) [s]."""
        return np.cumsum(self.leg_s)

    def passed(self, horizon_s: float) -> float:
        """Waypoints passed in some time, with the share of the leg to the next one."""
        times = np.concatenate(([0.0], self.arrivals))
        return float(np.interp(horizon_s, times, np.arange(len(times))))

    def before(self, leg: int) -> Drive:
        """The legs before one."""
        return Drive(self.states[: leg * self.nodes + 1], self.leg_s[:leg])

    def since(self, leg: int) -> Drive:
        """The legs from one on."""
        return Drive(self.states[leg * self.nodes :], self.leg_s[leg:])

    def then(self, other: Drive) -> Drive:
        """This drive, and another one that begins where it ends."""
        return Drive(
            np.concatenate((self.states[:-1], other.states)), np.concatenate((self.leg_s, other.leg_s))
        )


class Program:
    """The program for one boat and one number of legs; solves one after another."""

    def __init__(self, boat: Boat, *, legs: int, nodes: int) -> None:
        """Write the program down; takes seconds.

        Args:
            boat: Whose drive it is.
            legs: How many waypoints are passed.
            nodes: Of each leg.
        """
        self._boat, self._legs, self._nodes = boat, legs, nodes
        size, count = boat.size, legs * nodes
        self._width = size + len(boat.slew)  # of what a node has: a state, and how its commands change
        states = [ca.SX.sym(f"state_{k}", size) for k in range(count + 1)]
        changes = [ca.SX.sym(f"change_{k}", len(boat.slew)) for k in range(count)]
        leg_s = [ca.SX.sym(f"leg_{k}") for k in range(legs)]
        strays = [ca.SX.sym(f"stray_{k}") for k in range(legs)]
        places, start, weights = (
            ca.SX.sym("places", 2, legs),
            ca.SX.sym("start", size),
            ca.SX.sym("weights", legs),
        )
        reach = ca.SX.sym("reach", legs)
        rates, defect = [boat.pace(state) for state in states], self._defect()
        unknown: list[Any] = []
        still: list[Any] = [states[0] - start]
        near: list[Any] = []
        cost: Any = 0.0
        for leg in range(legs):
            unknown += [leg_s[leg], strays[leg]]
            cost += weights[leg] * leg_s[leg] + _STRAY * strays[leg]
            h = leg_s[leg] / nodes
            for k in range(leg * nodes, (leg + 1) * nodes):
                unknown += [states[k], changes[k]]
                cost += _ROUGH * h * ca.dot(changes[k], changes[k])
                still.append(defect(states[k], states[k + 1], changes[k], h, rates[k], rates[k + 1]))
            off = states[(leg + 1) * nodes][:2] - places[:, leg]
            near.append(ca.dot(off, off) - (reach[leg] + strays[leg]) ** 2)
        unknown.append(states[-1])
        constraints = ca.vertcat(*still, *near)
        equalities = constraints.numel() - legs
        self._bounds = {
            "lbx": self._limits(_LEG_S[0], -np.inf, boat.least, -1.0),
            "ubx": self._limits(_LEG_S[1], np.inf, boat.most, 1.0),
            "lbg": np.concatenate((np.zeros(equalities), np.full(legs, -np.inf))),
            "ubg": np.zeros(equalities + legs),
        }
        options: dict[str, Any] = {"print_time": False, "ipopt": _IPOPT}
        self._solver = ca.nlpsol(
            "course",
            "ipopt",
            {
                "x": ca.vertcat(*unknown),
                "f": cost,
                "g": constraints,
                "p": ca.vertcat(ca.vec(places), start, weights, reach),
            },
            options,
        )

    def solve(
        self,
        guess: Drive,
        places: np.ndarray,
        *,
        wanted: int,
        reach: np.ndarray,
        most: np.ndarray,
    ) -> Drive | None:
        """The quickest drive near a guess.

        Args:
            guess: From the state that the drive begins in; need not hold together.
            places: Of the waypoints, shape (legs, 2) [m].
            wanted: How many of them matter; the rest is driven without haste.
            reach: How near each is passed, shape (legs,) [m].
            most: How near, where that takes too long, shape (legs,) [m].

        Returns:
            The drive; None where IPOPT finds none.
        """
        states = self._boat.useful(guess.states)
        steps = np.diff(guess.times)[:, None] * self._boat.slew
        changes = np.clip(np.diff(states[:, MOTION:], axis=0) / steps, -1.0, 1.0)
        nodes = np.concatenate((states[:-1], changes), axis=1).reshape(self._legs, -1)
        begin = np.concatenate(
            (np.column_stack((guess.leg_s, np.zeros(self._legs), nodes)).ravel(), states[-1])
        )
        weights = np.where(np.arange(self._legs) < wanted, 1.0, 0.02)
        bounds = {side: each.copy() for side, each in self._bounds.items()}
        bounds["ubx"][1 : -self._boat.size : 2 + self._nodes * self._width] = np.maximum(most - reach, 0.0)
        found = self._solver(
            x0=begin,
            p=np.concatenate((places.ravel(), states[0], weights, reach)),
            **bounds,
        )
        if not self._solver.stats()["success"]:
            return None
        values = np.asarray(found["x"]).ravel()
        legs = values[: -self._boat.size].reshape(self._legs, -1)
        inner = legs[:, 2:].reshape(-1, self._width)[:, : self._boat.size]
        return Drive(np.vstack((inner, values[-self._boat.size :])), legs[:, 0])

    def _defect(self) -> ca.Function:
        """What is missing for two nodes to be a step apart."""
        size, n = self._boat.size, len(self._boat.slew)
        a, b, h, change = ca.SX.sym("a", size), ca.SX.sym("b", size), ca.SX.sym("h"), ca.SX.sym("change", n)
        rate_a, rate_b = ca.SX.sym("rate_a", MOTION), ca.SX.sym("rate_b", MOTION)
        middle = 0.5 * (a + b)
        middle[:MOTION] += h / 8.0 * (rate_a - rate_b)
        moved = a[:MOTION] + h / 6.0 * (rate_a + 4.0 * self._boat.pace(middle) + rate_b)
        told = a[MOTION:] + h * self._boat.slew * change
        return ca.Function("defect", [a, b, change, h, rate_a, rate_b], [ca.vertcat(moved, told) - b])

    def _limits(self, leg: float, motion: float, command: float, change: float) -> np.ndarray:
        n = len(self._boat.slew)
        state = np.concatenate((np.full(MOTION, motion), np.full(n, command)))
        node = np.concatenate((state, np.full(n, change)))
        one = np.concatenate(([leg, 0.0], np.tile(node, self._nodes)))
        return np.concatenate((np.tile(one, self._legs), state))
