"""Model-predictive control with valves that are open or closed, by trying what each choice leads to.

The rollout algorithm (Bertsekas, "Rollout, Policy Iteration, and Distributed Reinforcement Learning", 2021, §2.3): of
the combinations of valves that look best for now, each is followed by the LQR for some seconds on the model, and the
one that this ends best with is opened. The model has the push and the dead valves that the observer believes in,
shared pressure, and the thrust turning with the body. The cost has what a benchmark counts, open valves among it, and
at its end the LQR's cost-to-go.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from fulmar_core.controllers.body_frame import BodyState
from fulmar_core.controllers.controller import Inputs
from fulmar_core.controllers.lqr import Lqr, LqrWeights
from fulmar_core.controllers.planar_law import PlanarLaw
from fulmar_core.controllers.valve_allocation import ValveAllocation


@dataclass(frozen=True)
class MpcGains(LqrWeights):
    """Weights of the LQR that follows each choice, and of the cost of the choices; from `configs/controllers`."""

    choices: int = 16  # combinations of valves that are tried
    steps: int = 10  # for how many control steps each is followed
    near: float = 1.0  # cost of a second far from the goal, see `Mpc._cost` [1/s]
    aligned: float = 1.0  # same of a second away from the heading [1/s]
    position_scale: float = 0.01  # where half of the cost is lost [m]
    heading_scale_deg: float = 1.0  # [deg]
    gas: float = 0.01  # cost of one open valve for a second [1/s] # word: key of gains files
    pace: float = 10.0  # cost of a second at another velocity than the LQR asks for [s/m²]
    rest: float = 1.0  # factor on the LQR's cost of what is left at the end [-]

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.choices < 1 or self.steps < 1:
            raise ValueError("'choices' and 'steps' must be at least 1.")
        if self.observer is None:
            raise ValueError("'observer' is missing, which the model has its push from.")


class Mpc(PlanarLaw):
    """Looks ahead before it opens valves; for poses that stay where they are."""

    law = "mpc"
    title = "predictive control over valves"

    gains: MpcGains

    def prepare(self) -> None:
        """Build the model."""
        robot, gains = self.robot, self.gains
        if not robot.actuators.binary:
            raise ValueError("the MPC opens and closes valves; this robot has none of that kind.")
        base = LqrWeights(**{field.name: getattr(gains, field.name) for field in fields(LqrWeights)})
        self._base = Lqr(robot, self.task, base, control_hz=self.control_hz)
        self.estimator = gains.observer
        self._mass, self._inertia = robot.body.mass, robot.body.inertia[2]
        self._dt = dt = 1.0 / self.control_hz
        steps = robot.timing.substeps(self.control_hz)
        self._half = 0.5 * dt * dt * (steps + 1) / steps
        self._gain, self._rest = self._base.gain, gains.rest * self._base.cost_to_go
        self._most = np.deg2rad(gains.heading_error_limit_deg)
        self._near, self._aligned = dt * gains.near, dt * gains.aligned
        self._pace = dt * gains.pace
        self._far2, self._away2 = gains.position_scale**2, np.deg2rad(gains.heading_scale_deg) ** 2
        allocation = self._base.allocation
        assert isinstance(allocation, ValveAllocation)
        # Of combinations with the same wrench all are kept: a dead valve may be in the cheapest.
        self._commands, wrench, self._offset = allocation.every
        self._force, self._torque = wrench[:, 0] + 1j * wrench[:, 1], wrench[:, 2]
        self._slope = 2.0 * allocation.weight @ wrench.T
        self._price = dt * gains.gas * self._commands.sum(axis=1)  # word: key of gains files

    def command(self, inputs: Inputs) -> np.ndarray:
        """Choose valves; shapes as in `Controller.act`."""
        return self.plan(self.frame.body_state(inputs))

    def plan(self, now: BodyState) -> np.ndarray:
        """Valves to open now, shape (..., n).

        Vectors in the plane are complex numbers, and the frame is the target's: rotations are products.
        """
        leading, rows, g = now.turn.shape, now.turn.size, self.gains
        spots = np.arange(rows)
        yaw = -now.turn.reshape(rows)
        turned = np.exp(1j * yaw)
        place = -turned * (now.goal[0] + 1j * now.goal[1]).reshape(rows)
        speed = turned * (now.motion[0] + 1j * now.motion[1]).reshape(rows)
        rate, push = now.motion[2].reshape(rows), now.push.reshape(rows, 3)
        force, torque = turned * (push[:, 0] + 1j * push[:, 1]), push[:, 2]
        brakes = self._brakes(place, turned, push)
        dead = self._dead(now.alive, rows)
        wanted = self._wanted(place, yaw, speed, rate, force, torque, brakes)
        worth = self._worth(wanted, turned, dead)
        count = min(g.choices, worth.shape[1])
        tried = np.argpartition(worth, count - 1, axis=1)[:, :count]
        every = np.repeat(spots, count)
        place, yaw, speed, rate, force, torque, brakes = (
            each[every] for each in (place, yaw, speed, rate, force, torque, brakes)
        )
        dead = None if dead is None else dead[every]
        choice, cost = tried.reshape(-1), np.zeros(rows * count)
        for step in range(g.steps):
            if step:
                wanted = self._wanted(place, yaw, speed, rate, force, torque, brakes)
                choice = np.argmin(self._worth(wanted, np.exp(1j * yaw), dead), axis=1)
            cost += self._price[choice]
            pull = (self._force[choice] * np.exp(1j * (yaw + 0.5 * self._dt * rate)) + force) / self._mass
            spin = (self._torque[choice] + torque) / self._inertia
            place = place + self._dt * speed + self._half * pull
            yaw = yaw + self._dt * rate + self._half * spin
            speed, rate = speed + self._dt * pull, rate + self._dt * spin
            d2, e2 = place.real**2 + place.imag**2, yaw * yaw
            off = speed + self._cut(place, brakes) / self._base.lead
            cost += self._pace * (off.real**2 + off.imag**2)
            cost += d2 * (self._near / (d2 + self._far2)) + e2 * (self._aligned / (e2 + self._away2))
        cost += self._left(place, yaw, speed, rate, brakes)
        best = np.argmin(cost.reshape(rows, count), axis=1)
        return np.asarray(self._commands[tried[spots, best]].reshape(*leading, -1))

    def _left(
        self, place: np.ndarray, yaw: np.ndarray, speed: np.ndarray, rate: np.ndarray, brakes: np.ndarray
    ) -> np.ndarray:
        """Cost of what is left at the end, shape (rows,).

        The LQR's own for heading and place, but far away a velocity is measured by the one that the LQR asks for there:
        its cost-to-go knows no limits, and would have the robot arrive faster than it can brake.
        """
        p = self._rest
        error = self._cut(place, brakes)
        off = speed + error / self._base.lead
        cost = p[3, 3] * (off.real**2 + off.imag**2)
        cost += (p[0, 0] - p[0, 3] ** 2 / p[3, 3]) * (error.real**2 + error.imag**2)
        cost += p[2, 2] * yaw * yaw + 2.0 * p[2, 5] * yaw * rate + p[5, 5] * rate * rate
        return np.asarray(cost)

    def _brakes(self, place: np.ndarray, turned: np.ndarray, push: np.ndarray) -> np.ndarray:
        """Deceleration that valves and push allow on the straight way to the goal, twice [m/s²]."""
        away = place * np.conj(turned) / np.maximum(np.abs(place), 1e-9)
        authority = self._base.authority.along(np.stack((away.real, away.imag), axis=-1), push[:, :2])
        return np.asarray(2.0 * self.gains.braking * authority / self._mass)

    def _cut(self, place: np.ndarray, brakes: np.ndarray) -> np.ndarray:
        """Errors of place as the LQR counts them."""
        distance = np.abs(place) + 1e-9
        limit = np.minimum(self.gains.position_error_limit, self._base.lead * np.sqrt(brakes * distance))
        return np.asarray(place * np.minimum(1.0, limit / distance))

    def _wanted(
        self,
        place: np.ndarray,
        yaw: np.ndarray,
        speed: np.ndarray,
        rate: np.ndarray,
        force: np.ndarray,
        torque: np.ndarray,
        brakes: np.ndarray,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Force in the target's frame and moment that the LQR asks for, shapes (rows,)."""
        k = self._gain
        pull = -k[0, 0] * self._cut(place, brakes) - k[0, 3] * speed - force
        return pull, -k[2, 2] * np.clip(yaw, -self._most, self._most) - k[2, 5] * rate - torque

    def _worth(
        self, wanted: tuple[np.ndarray, np.ndarray], turned: np.ndarray, dead: np.ndarray | None
    ) -> np.ndarray:
        """Cost of each combination for a wrench, less what all have in common, shape (rows, combinations)."""
        pull = wanted[0] * np.conj(turned)
        wrench = np.stack((pull.real, pull.imag, wanted[1]), axis=1)
        cost = self._offset - wrench @ self._slope
        return np.asarray(cost if dead is None else cost + dead)

    def _dead(self, alive: np.ndarray | None, rows: int) -> np.ndarray | None:
        """What opening a dead valve costs: more than anything; None where all live."""
        if alive is None or alive.all():
            return None
        return np.where((1.0 - alive.reshape(rows, -1)) @ self._commands.T > 0.5, 1e9, 0.0)

    def derived(self) -> dict[str, Any]:
        """What else the commands depend on."""
        return super().derived() | self._base.derived()
