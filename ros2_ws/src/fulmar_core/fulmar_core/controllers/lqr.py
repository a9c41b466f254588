"""Discrete linear-quadratic regulator for a planar robot that thrusters or fans push.

The linear model comes from the core's own dynamics, the gain from the discrete algebraic Riccati equation,
and the commands from the LQR's own cost-to-go: for x⁺ = A x + B w the cost of a wrench w is, up to a constant,
(w - w*)ᵀ (R + BᵀPB) (w - w*) with w* = -K x (complete the square in Bertsekas, "Dynamic Programming and
Optimal Control", vol. 1, §4.1), so the best reachable wrench is the one nearest to w* in that metric.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from fulmar_core.controllers.allocation import allocation_of
from fulmar_core.controllers.body_frame import BodyState, Vector
from fulmar_core.controllers.controller import Inputs
from fulmar_core.controllers.planar_law import PlanarLaw
from fulmar_core.dynamics.linear_model import linearise_wrench
from fulmar_core.estimators.actuator_health.filters import HealthSettings
from fulmar_core.robots.actuators.force_authority import ForceAuthority
from fulmar_core.robots.actuators.pushing import Pushing
from fulmar_core.states.arrays import side_by_side
from fulmar_core.states.planar import at_rest


@dataclass(frozen=True)
class Regulator:
    """u = -gain x, for x' = a x + b u and the cost x' q x + u' r u of each step."""

    gain: np.ndarray  # (m, n)
    cost_to_go: np.ndarray  # (n, n): x' p x is what is still to be paid
    hessian: np.ndarray  # (m, m): what an input u costs, now and later, is u' (r + b' p b) u


def regulator(a: np.ndarray, b: np.ndarray, q: np.ndarray, r: np.ndarray) -> Regulator:
    """Solve the discrete algebraic Riccati equation.

    Args:
        a: Shape (n, n).
        b: Shape (n, m).
        q: Cost of states, shape (n, n).
        r: Cost of inputs, shape (m, m).

    Raises:
        numpy.linalg.LinAlgError: No feedback makes it stable.
    """
    # It takes a fifth of a second to import, which every process would pay for, and few solve anything.
    from scipy.linalg import solve_discrete_are

    p = solve_discrete_are(a, b, q, r)
    hessian = r + b.T @ p @ b
    return Regulator(np.linalg.solve(hessian, b.T @ p @ a), p, hessian)


FAR = 1.0  # from where a valve costs most [m]


@dataclass(frozen=True)
class LqrWeights:
    """Weights and limits, as read from `configs/controllers/<robot>_lqr.yaml`.

    Costs are per second, so one file serves every command rate.
    """

    position: float  # per m²
    heading: float  # per rad²
    velocity: float  # per (m/s)²
    yaw_rate: float  # per (rad/s)²
    force: float  # per N²
    torque: float  # per (N·m)²
    open_valve: float  # of each open valve
    position_error_limit: float  # errors beyond count as this, which sets the cruising speed [m]
    heading_error_limit_deg: float  # same for the turn rate [deg]
    tracking_velocity: float = 0.0  # as 'velocity', where velocities are the goal; 0: the same
    tracking_torque: float = 0.0  # as 'torque', where a turn rate is the goal; 0: the same
    overshoot: float = 0.0  # how far beyond a waypoint to aim where the path goes straight on [m]
    open_valve_far: float = 0.0  # same, more of it, from `FAR` on, where precision is worth less
    braking: float = 0.0  # share of the deceleration that valves and push allow; 0: no heed [-]
    least_open_s: float = 0.0  # on/off valves are left as they are for so long [s]
    observer: HealthSettings | None = (
        None  # how far to trust what; without, observations are believed as they are
    )
    speed_around: float = 0.0  # among obstacles, as a share; tasks without any need none [-]

    def __post_init__(self) -> None:
        if min(self.position, self.heading, self.velocity, self.yaw_rate, self.open_valve) < 0.0:
            raise ValueError("weights must not be negative.")
        if min(self.force, self.torque, self.position_error_limit, self.heading_error_limit_deg) <= 0.0:
            raise ValueError("force, torque and the error limits must be greater than 0.")
        if min(self.overshoot, self.tracking_velocity, self.tracking_torque, self.least_open_s) < 0.0:
            raise ValueError("'overshoot', 'least_open_s' and what is for tracking must not be negative.")
        if not 0.0 <= self.braking <= 1.0:
            raise ValueError("'braking' must lie in [0, 1].")


class Lqr(PlanarLaw):
    """LQR on the estimated or measured state; holds the heading where the task has one."""

    law = "lqr"
    title = "LQR"

    gains: LqrWeights

    def prepare(self) -> None:
        """Solve for the gain and list the valve combinations."""
        robot, gains, actuators = self.robot, self.gains, self.robot.actuated_by(Pushing)
        self._most_turn = np.deg2rad(gains.heading_error_limit_deg)
        dt = 1.0 / self.control_hz
        model = linearise_wrench(robot, at_rest(*np.zeros(3)), np.zeros(3), dt)
        velocity = (self.frame.tracks and gains.tracking_velocity) or gains.velocity
        q = np.array([gains.position] * 2 + [gains.heading] + [velocity] * 2 + [gains.yaw_rate])
        torque = (self.frame.tracks and gains.tracking_torque) or gains.torque
        r = dt * np.diag([gains.force, gains.force, torque])
        # What has no goal is not a state.
        used = [3, 4, 5] if self.frame.tracks else [0, 1, 2, 3, 4, 5] if self.frame.heads else [0, 1, 3, 4, 5]
        a, b = model.a[np.ix_(used, used)], model.b[used]
        best = regulator(a, b, dt * np.diag(q[used]), r)
        self.cost_to_go, self.gain = best.cost_to_go, best.gain
        self._hessian = hessian = best.hessian
        self.authority = ForceAuthority(actuators)
        # How far from the goal the law asks for 1 m/s [s].
        self.lead = 1.0 if self.frame.tracks else float(self.gain[0, used.index(3)] / self.gain[0, 0])
        self.estimator = gains.observer
        self.allocation = allocation_of(actuators, weight=hessian, cost=dt * gains.open_valve)

    def reset(self) -> None:
        """Forget the past."""
        super().reset()
        self._last: np.ndarray | None = None
        self._age_s = 0.0  # of the last choice

    def command(self, inputs: Inputs) -> np.ndarray:
        """Choose valves; shapes as in `Controller.act`."""
        now = self.frame.body_state(inputs)
        far = np.minimum(np.hypot(*now.goal) / FAR, 1.0) ** 2
        dearer = far * self.gains.open_valve_far / self.control_hz if self.gains.open_valve_far else None
        return self._steady(np.asarray(self.allocation.best(self.wanted(inputs, now), now.alive, dearer)))

    def _steady(self, command: np.ndarray) -> np.ndarray:
        """What was chosen last, until valves have had the time to open and close."""
        self._age_s += 1.0 / self.control_hz
        hasty = self.robot.actuators.binary and self._age_s < self.gains.least_open_s - 1e-6
        if self._last is None or self._last.shape != command.shape or not hasty:
            self._last, self._age_s = command, 0.0
        return np.asarray(self._last)

    def wanted(self, inputs: Inputs, now: BodyState) -> np.ndarray:
        """Wrench that the valves should bring up, in the body's frame, shape (..., 3) [N, N, N·m].

        Args:
            inputs: Hold further targets, obstacles and wanted velocities.
            now: Where the robot is and what pushes it.
        """
        wrench = -self.error_state(inputs, now) @ self.gain.T
        if self.frame.tracks:
            u, v, r = now.motion
            m = self.robot.body.mass
            wrench = wrench + side_by_side(-m * r * v, m * r * u, 0.0 * r)  # what keeps u and v in a turn
        return np.asarray(wrench - now.push)

    def error_state(self, inputs: Inputs, now: BodyState) -> np.ndarray:
        """State minus goal in the body frame, with far errors cut to the limits."""
        if self.frame.tracks:
            return np.asarray(side_by_side(*now.motion) - inputs.goal.current)
        to_goal = side_by_side(*self._aim(inputs, now))
        distance = np.sqrt((to_goal * to_goal).sum(axis=-1, keepdims=True))
        limit = self.gains.position_error_limit * self.share_of_speed
        if self.gains.braking:
            brake = self.authority.along(-to_goal / np.maximum(distance, 1e-9), now.push[..., :2])[..., None]
            fastest = np.sqrt(2.0 * self.gains.braking * brake / self.robot.body.mass * distance)
            limit = np.minimum(limit, self.lead * fastest) + 1e-9
        parts = [-to_goal * (limit / np.maximum(distance, limit))]
        if self.frame.heads:
            parts.append(-now.turn.clip(-self._most_turn, self._most_turn)[..., None])
        parts.append(side_by_side(*now.motion))
        return np.concatenate(parts, axis=-1)

    def _aim(self, inputs: Inputs, now: BodyState) -> Vector:
        """Where to go: the goal, beyond a waypoint, or along the way around obstacles, in the body frame [m]."""
        x, y = now.goal
        if self.frame.crosses_obstacles:
            u, v, _ = now.motion
            direction = np.where(np.hypot(u, v) > 0.05, np.arctan2(v, u), np.arctan2(y, x))
            room = self.room(inputs, direction)
            shorter = np.minimum(1.0, room / np.maximum(np.hypot(x, y), 1e-6))
            return x * shorter, y * shorter
        if self.frame.passes:
            dx, dy = self.frame.next_leg(inputs)
            far, leg = np.maximum(np.hypot(x, y), 1e-6), np.maximum(np.hypot(dx, dy), 1e-6)
            onward = np.maximum((x * dx + y * dy) / (far * leg), 0.0)
            longer = 1.0 + self.gains.overshoot * onward / far
            return x * longer, y * longer
        return x, y

    def derived(self) -> dict[str, Any]:
        """What else the commands depend on."""
        return super().derived() | {
            "gain": np.round(self.gain, 9).tolist(),
            "hessian": np.round(self._hessian, 9).tolist(),
        }
