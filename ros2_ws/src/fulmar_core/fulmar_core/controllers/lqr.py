"""Discrete linear-quadratic regulator for a planar robot with gas thrusters.

The linear model comes from the core's own dynamics, the gain from the discrete algebraic Riccati equation,
and the valves from the LQR's own cost-to-go: for x⁺ = A x + B w the cost of a wrench w is, up to a constant,
(w - w*)ᵀ (R + BᵀPB) (w - w*) with w* = -K x (complete the square in Bertsekas, "Dynamic Programming and
Optimal Control", vol. 1, §4.1), so the best reachable wrench is the one nearest to w* in that metric.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import solve_discrete_are

from fulmar_core.actuators.thrusters import Thrusters
from fulmar_core.controllers.around import Around
from fulmar_core.controllers.law import Law
from fulmar_core.controllers.opening_allocation import OpeningAllocation
from fulmar_core.controllers.seen import Vector
from fulmar_core.controllers.valve_allocation import ValveAllocation
from fulmar_core.counter_rng import Draws
from fulmar_core.disturbances.scenario import Scenario, draw_world
from fulmar_core.dynamics.free_body import free_body_step
from fulmar_core.planar import PlanarState
from fulmar_core.robot import Robot
from fulmar_core.tasks import Task


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
    tracking_torque: float = 0.0  # as 'torque', where a turn rate is the goal; 0: the same
    overshoot: float = 0.0  # how far beyond a waypoint to aim where the course goes straight on [m]
    around: Around | None = None  # how to keep off obstacles; tasks without any need nothing

    def __post_init__(self) -> None:
        """Refuse weights without a stabilising solution."""
        if min(self.position, self.heading, self.velocity, self.yaw_rate, self.open_valve) < 0.0:
            raise ValueError("weights must not be negative.")
        if min(self.force, self.torque, self.position_error_limit, self.heading_error_limit_deg) <= 0.0:
            raise ValueError("force, torque and the error limits must be greater than 0.")
        if min(self.overshoot, self.tracking_torque) < 0.0:
            raise ValueError("'overshoot' and 'tracking_torque' must not be negative.")


def linear_model(robot: Robot, control_dt: float) -> tuple[np.ndarray, np.ndarray]:
    """Linearise the core's dynamics about rest by central differences.

    Args:
        robot: A planar robot with its nominal body.
        control_dt: Time of one control step, a multiple of the physics step [s].

    Returns:
        A (6, 6) and B (6, 3) of x⁺ = A x + B w, with x = [x, y, yaw, v_x, v_y, yaw rate] and
        w = [F_x, F_y, M_z], all in the body frame at rest.
    """
    delta = 1e-4
    inputs = delta * np.concatenate((np.eye(9), -np.eye(9))).T
    calm = Scenario("calm", sensor_noise=False, body="nominal")
    world = draw_world(robot, calm, Draws(0, np.zeros(18), np.zeros(18)))
    push, still = (inputs[6], inputs[7], inputs[8]), (np.zeros(18),) * 3
    state = PlanarState(*inputs[:6])
    for _ in range(robot.timing.substeps(1.0 / control_dt)):
        state = free_body_step(state, push, still, world, robot.hydrodynamics, robot.timing.physics_dt)
    after = np.stack((state.x, state.y, state.yaw, state.vx, state.vy, state.yaw_rate))
    slopes = (after[:, :9] - after[:, 9:]) / (2.0 * delta)
    return slopes[:, :6], slopes[:, 6:]


class Lqr(Law):
    """LQR on a task's observation; holds the heading where the task has one."""

    law = "lqr"
    title = "LQR"

    def __init__(
        self,
        robot: Robot,
        task: Task,
        gains: LqrWeights,
        *,
        control_hz: float | None = None,
        name: str | None = None,
    ) -> None:
        """Solve for the gain and list the valve combinations.

        Args:
            robot: A planar robot with thrusters.
            task: A task whose observation holds the goal in the body frame, and the motion.
            gains: What errors and efforts cost.
            control_hz: Command rate; the robot's own by default [Hz].
            name: Under which it was chosen.
        """
        super().__init__(robot, task, gains, control_hz=control_hz, name=name)
        if not isinstance(robot.actuators, Thrusters):
            raise ValueError("the LQR allocates valves; this robot has none.")
        self._weights = gains
        dt = 1.0 / self.control_hz
        a, b = linear_model(robot, dt)
        q = np.array([gains.position] * 2 + [gains.heading] + [gains.velocity] * 2 + [gains.yaw_rate])
        torque = (self.reader.tracks and gains.tracking_torque) or gains.torque
        r = dt * np.diag([gains.force, gains.force, torque])
        # What has no goal is not a state.
        used = (
            [3, 4, 5] if self.reader.tracks else [0, 1, 2, 3, 4, 5] if self.reader.heads else [0, 1, 3, 4, 5]
        )
        a, b = a[np.ix_(used, used)], b[used]
        p = solve_discrete_are(a, b, dt * np.diag(q[used]), r)
        self._hessian = hessian = r + b.T @ p @ b
        self._gain = np.linalg.solve(hessian, b.T @ p @ a)
        allocation = OpeningAllocation if robot.actuators.continuous else ValveAllocation
        self._allocation = allocation(robot.actuators, weight=hessian, valve_cost=dt * gains.open_valve)

    def command(self, observation: np.ndarray) -> np.ndarray:
        """Choose valves; shapes as in `Controller.act`."""
        wrench = -self._error_state(observation) @ self._gain.T
        if self.reader.tracks:
            u, v, r = self.reader.motion(observation)
            m = self.robot.body.mass
            wrench = wrench + np.stack(
                (-m * r * v, m * r * u, 0.0 * r), axis=-1
            )  # what keeps u and v in a turn
        return np.asarray(self._allocation.best(wrench))

    def _error_state(self, observation: np.ndarray) -> np.ndarray:
        """State minus goal in the body frame, with far errors cut to the limits."""
        if self.reader.tracks:
            return -np.stack(self.reader.velocity_error(observation), axis=-1)
        to_goal = np.stack(self._aim(observation), axis=-1)
        distance = np.linalg.norm(to_goal, axis=-1, keepdims=True)
        limit = self._weights.position_error_limit * self.share_of_speed
        parts = [-to_goal * (limit / np.maximum(distance, limit))]
        if self.reader.heads:
            most = np.deg2rad(self._weights.heading_error_limit_deg)
            parts.append(-np.clip(self.reader.turn(observation), -most, most)[..., None])
        parts.append(np.stack(self.reader.motion(observation), axis=-1))
        return np.concatenate(parts, axis=-1)

    def _aim(self, observation: np.ndarray) -> Vector:
        """Where to go: the goal, beyond a waypoint, or around an obstacle, in the body frame [m]."""
        x, y = self.reader.goal(observation)
        if self.reader.crosses_obstacles:
            u, v, _ = self.reader.motion(observation)
            course = np.where(np.hypot(u, v) > 0.05, np.arctan2(v, u), np.arctan2(y, x))
            (x, y), room = self.around((x, y), observation, course)
            shorter = np.minimum(1.0, room / np.maximum(np.hypot(x, y), 1e-6))
            return x * shorter, y * shorter
        if self.reader.passes:
            dx, dy = self.reader.next_leg(observation)
            far, leg = np.maximum(np.hypot(x, y), 1e-6), np.maximum(np.hypot(dx, dy), 1e-6)
            onward = np.maximum((x * dx + y * dy) / (far * leg), 0.0)
            longer = 1.0 + self._weights.overshoot * onward / far
            return x * longer, y * longer
        return x, y

    def derived(self) -> dict[str, Any]:
        """What else the commands depend on."""
        return super().derived() | {
            "gain": np.round(self._gain, 9).tolist(),
            "hessian": np.round(self._hessian, 9).tolist(),
        }
