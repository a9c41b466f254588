"""Discrete linear-quadratic regulator for a planar robot with on/off thrusters.

The linear model comes from the core's own dynamics, the gain from the discrete algebraic Riccati equation, and
the valves from the LQR's own cost-to-go: for x⁺ = A x + B w the cost of a wrench w is, up to a constant,
(w - w*)ᵀ (R + BᵀPB) (w - w*) with w* = -K x (complete the square in Bertsekas, "Dynamic Programming and Optimal
Control", vol. 1, §4.1), so the best reachable wrench is the one nearest to w* in that metric.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from scipy.linalg import solve_discrete_are

from fulmar_core.config import load_config
from fulmar_core.controllers.valve_allocation import ValveAllocation
from fulmar_core.dynamics.rigid_body import Disturbance, MassProperties, step
from fulmar_core.errors import ConfigError
from fulmar_core.paths import config_names, config_path
from fulmar_core.robot import Robot
from fulmar_core.rotation import Array
from fulmar_core.state import planar_state
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

    def __post_init__(self) -> None:
        """Refuse weights without a stabilising solution."""
        if min(self.position, self.heading, self.velocity, self.yaw_rate, self.open_valve) < 0.0:
            raise ValueError("weights must not be negative.")
        if min(self.force, self.torque, self.position_error_limit, self.heading_error_limit_deg) <= 0.0:
            raise ValueError("force, torque and the error limits must be greater than 0.")


def linear_model(robot: Robot, control_dt: float) -> tuple[np.ndarray, np.ndarray]:
    """Linearise the core's dynamics about rest by central differences.

    Args:
        robot: A planar robot with its nominal body.
        control_dt: Time of one control step, a multiple of the physics step [s].

    Returns:
        A (6, 6) and B (6, 3) of x⁺ = A x + B w, with x = [x, y, yaw, v_x, v_y, yaw rate] and
        w = [F_x, F_y, M_z], all in the body frame at rest.
    """
    body = MassProperties(np.array([robot.body.mass]), np.array(robot.body.inertia))
    calm = Disturbance(np.zeros(3), np.zeros(3))

    def advance(x: np.ndarray, w: np.ndarray) -> np.ndarray:
        after = step(
            planar_state(x[0], x[1], x[2], vx=x[3], vy=x[4], yaw_rate=x[5]),
            np.array([w[0], w[1], 0.0]),
            np.array([0.0, 0.0, w[2]]),
            body=body,
            disturbance=calm,
            planar=True,
            dt=robot.timing.physics_dt,
            substeps=robot.timing.substeps(1.0 / control_dt),
        )
        turn = after.angular_velocity_in_body[2:3]
        return np.concatenate((after.position_in_world[:2], [after.yaw], after.velocity_in_world[:2], turn))

    delta = 1e-4
    x0, w0 = np.zeros(6), np.zeros(3)
    a = [(advance(x0 + delta * e, w0) - advance(x0 - delta * e, w0)) / (2 * delta) for e in np.eye(6)]
    b = [(advance(x0, w0 + delta * e) - advance(x0, w0 - delta * e)) / (2 * delta) for e in np.eye(3)]
    return np.stack(a, axis=1), np.stack(b, axis=1)


class Lqr:
    """LQR on a task's observation; holds the heading where the task has one."""

    name = "lqr"

    def __init__(
        self, robot: Robot, task: Task, weights: LqrWeights, *, control_hz: float | None = None
    ) -> None:
        """Solve for the gain and list the valve combinations.

        Args:
            robot: A planar robot with thrusters.
            task: A task whose observation holds the goal in the body frame, and the motion.
            weights: What errors and efforts cost.
            control_hz: Command rate; the robot's own by default [Hz].
        """
        self.control_hz = control_hz or robot.timing.control_hz
        self.observation_names = task.observation_names
        self._robot, self._task, self._weights = robot, task, weights
        self._heads = "sin_heading_error" in self.observation_names
        dt = 1.0 / self.control_hz
        a, b = linear_model(robot, dt)
        q = [weights.position] * 2 + [weights.heading if self._heads else 0.0]
        q += [weights.velocity] * 2 + [weights.yaw_rate]
        r = dt * np.diag([weights.force, weights.force, weights.torque])
        used = (
            [0, 1, 2, 3, 4, 5] if self._heads else [0, 1, 3, 4, 5]
        )  # a heading without a goal is not a state
        a, b = a[np.ix_(used, used)], b[used]
        p = solve_discrete_are(a, b, dt * np.diag(np.array(q)[used]), r)
        self._hessian = hessian = r + b.T @ p @ b
        self._gain = np.linalg.solve(hessian, b.T @ p @ a)
        self._allocation = ValveAllocation(
            robot.actuators, weight=hessian, valve_cost=dt * weights.open_valve
        )
        self._column = {name: i for i, name in enumerate(self.observation_names)}

    def reset(self) -> None:
        """Nothing to forget: the LQR has no memory."""

    def act(self, observation: Array) -> Array:
        """Choose valves; shapes as in `Controller.act`."""
        return self._allocation.best(-self._error_state(np.asarray(observation, dtype=float)) @ self._gain.T)

    def _error_state(self, observation: np.ndarray) -> np.ndarray:
        """State minus goal in the body frame, with far errors cut to the limits."""

        def term(name: str) -> np.ndarray:
            return np.asarray(observation[..., self._column[name]])

        to_goal = np.stack((term("goal_x_in_body"), term("goal_y_in_body")), axis=-1)
        distance = np.linalg.norm(to_goal, axis=-1, keepdims=True)
        limit = self._weights.position_error_limit
        parts = [-to_goal * (limit / np.maximum(distance, limit))]
        if self._heads:
            turn = np.arctan2(term("sin_heading_error"), term("cos_heading_error"))
            most = np.deg2rad(self._weights.heading_error_limit_deg)
            parts.append(-np.clip(turn, -most, most)[..., None])
        parts += [term(name)[..., None] for name in ("velocity_x_in_body", "velocity_y_in_body", "yaw_rate")]
        return np.concatenate(parts, axis=-1)

    def metadata(self) -> dict[str, Any]:
        """Robot, task, rate and weights, with the SHA-256 of everything that the commands depend on."""
        told = {
            "controller": self.name,
            "robot": self._robot.name,
            "task": self._task.name,
            "control_hz": self.control_hz,
            "weights": asdict(self._weights),
        }
        derived = {
            "observation_names": self.observation_names,
            "actuators": asdict(self._robot.actuators),
            "gain": np.round(self._gain, 9).tolist(),
            "hessian": np.round(self._hessian, 9).tolist(),
        }
        text = json.dumps(told | derived, sort_keys=True)
        return told | {"sha256": hashlib.sha256(text.encode()).hexdigest()}


def load_lqr(robot: Robot, task: Task, *, control_hz: float | None = None) -> Lqr:
    """LQR with the weights of `configs/controllers/<robot>_lqr.yaml`.

    Args:
        robot: The robot.
        task: The task.
        control_hz: Command rate; the robot's own by default [Hz].

    Returns:
        The controller.

    Raises:
        ConfigError: No weights for this robot, a mistake in them, or a rate that the physics cannot keep.
    """
    name = f"{robot.name}_lqr"
    if name not in config_names("controllers"):
        raise ConfigError(f"no LQR weights for '{robot.name}'. Write configs/controllers/{name}.yaml.")
    weights = load_config(LqrWeights, config_path("controllers", name))
    try:
        return Lqr(robot, task, weights, control_hz=control_hz)
    except ValueError as error:
        hz = control_hz or robot.timing.control_hz
        raise ConfigError(f"LQR for '{robot.name}' at {hz:g} Hz: {error}") from error
