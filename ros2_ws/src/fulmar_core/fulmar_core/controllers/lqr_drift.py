"""DRIFT's own LQR, as published: what ours and the policy are compared with.

Source: RANS at 3572d88, omniisaacgymenvs/mujoco_envs/controllers/discrete_LQR_controller.py and cfg/controller; thesis
§3.5.4 and Table 3.4. Seven states [x, y, v_x, v_y, q_w, q_z, yaw rate] in the world; at every control step the model is
found by central differences through the simulator, the gain by the Riccati equation, and the eight numbers that come
out are made valves by a threshold, a normalisation and a rounding that know nothing of shared pressure or of
directions.

The published model has three peculiarities, and its behaviour depends on all of them, so they are here as well:

- The simulator normalises quaternions, so the model has only the part of their error that turns; but what q_w makes of
  itself is written over with 1.
- Thrusts are off by -0.01 √½ where they should be off by -0.01, so that the inputs' effects come out a seventh too
  small.
- Exact zeros among these effects are written over with 1e-4.

What is different here, and why:

- The weights. With those of Table 3.4 (`Optimal_LQR_DC.yaml`; 1e-4 and 1e-5 per m², 100 per (m/s)²) and the order of
  states that the code has, commands do not reach the threshold of 0.25 three metres away and the platform stays where
  it is: PT5 0 %, AAS 0.02. Its other file of weights, `Optimal_LQR_DAC.yaml`, behaves as Table 3.5 says; it is ours.
- Differences go through the core's own dynamics in its own steps, not through one step of 0.2 s; and through a copy.
  The published ones go through the simulation that is being evaluated, and leave it 0.2 s later than it was.
- Gains are kept for headings and turn rates that are the same to 1° and 0.05 rad/s, and not solved for again.

Measured in MuJoCo (256 trajectories; published in brackets), PT5 PT1 / OT5 OT1 in per cent, AAS: ideal 63 7 / 59 22,
0.08 (73 17 / 27 5, 0.10); torque 76 18 / 26 4, 0.09 (57 6 / 3 0, 0.35); force 0.4 N 0 0 / 71 21, 0.15 (23 0 / 30 6,
0.15); force and torque 41 0 / 43 8, 0.10 (13 0 / 3 1, 0.32); one valve lost 49 6 / 39 10, 0.11 (40 5 / 20 4, 0.16);
two 21 2 / 18 5, 0.18 (12 1 / 11 2, 0.22). So positions are good and headings poor, a torque takes the rest of the
heading, a force the position, and lost valves both. What is not reproduced is the collapse under velocity noise: 0.04
m/s gives 75 13 / 79 23, 0.15 (14 0 / 2 0, 0.29).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from fulmar_core.controllers.controller import Inputs
from fulmar_core.controllers.lqr import regulator
from fulmar_core.controllers.planar_law import PlanarLaw
from fulmar_core.dynamics.free_body import free_body_step
from fulmar_core.dynamics.linear_model import nominal_worlds, slopes
from fulmar_core.robots.actuators.pushing import PLANAR
from fulmar_core.robots.actuators.thrusters import Thrusters
from fulmar_core.states.planar import PlanarState
from fulmar_core.states.rotation import wrap_angle

STEP, LEAST_STEP = 0.01, 1e-3  # differences of states, relative and at least; inputs: STEP
SHORT = np.sqrt(0.5)  # of the negative difference of inputs
INSTEAD_OF_ZERO = 1e-4
STILL = (np.zeros(1),) * 3  # no push from outside
SAME_HEADING, SAME_RATE = np.deg2rad(1.0), 0.05  # [rad], [rad/s]


@dataclass(frozen=True)
class DriftWeights:
    """Weights and rounding, as read from `configs/controllers/<robot>_lqr_drift.yaml`."""

    states: tuple[float, float, float, float, float, float, float]  # Q's diagonal, in the order of the states
    input: float  # R's diagonal
    threshold: float  # inputs nearer to 0 are 0
    bias: float  # a normalised input opens its valve above one half and this

    def __post_init__(self) -> None:
        if min(self.states) <= 0.0 or self.input <= 0.0:
            raise ValueError("the weights of states and inputs must be greater than 0.")


class LqrDrift(PlanarLaw):
    """The published law; remembers its heading, whose quaternion does not jump after half a turn."""

    law = "lqr_drift"
    title = "DRIFT's published LQR"

    gains: DriftWeights

    def prepare(self) -> None:
        """Check the valves."""
        if not self.robot.actuators.binary:
            raise ValueError("DRIFT's LQR opens and closes valves; this robot has none of that kind.")
        self._valves = self.robot.actuated_by(Thrusters)
        self._world = nominal_worlds(self.robot, 1)
        self._known: dict[tuple[int, int], np.ndarray] = {}

    def reset(self) -> None:
        """Forget the heading."""
        super().reset()
        self._heading: np.ndarray | None = None

    def command(self, inputs: Inputs) -> np.ndarray:
        """Choose valves; shapes as in `Controller.act`."""
        yaw = self._unwound(-self.frame.turn(inputs))
        (x, y), (u, v, rate) = self.frame.goal(inputs), self.frame.motion(inputs)
        c, s = np.cos(yaw), np.sin(yaw)
        # Target minus state, in the frame of the target.
        error = np.stack(
            (
                c * x - s * y,
                s * x + c * y,
                -(c * u - s * v),
                -(s * u + c * v),
                1.0 - np.cos(0.5 * yaw),
                -np.sin(0.5 * yaw),
                -rate,
            ),
            axis=-1,
        )
        return self._valves_of(np.einsum("...ij,...j->...i", self._gains(yaw, rate), error))

    def _valves_of(self, inputs: np.ndarray) -> np.ndarray:
        """Numbers to valves, shape (..., n)."""
        inputs = np.where(np.abs(inputs) < self.gains.threshold, 0.0, inputs)
        low, high = np.min(inputs, axis=-1, keepdims=True), np.max(inputs, axis=-1, keepdims=True)
        share = (inputs - low) / np.where(high > low, high - low, 1.0)
        return np.where(high != 0.0, np.round(share - self.gains.bias), 0.0)

    def _unwound(self, yaw: np.ndarray) -> np.ndarray:
        """A heading that does not jump, shape (...,) [rad]."""
        if self._heading is not None and self._heading.shape == yaw.shape:
            yaw = self._heading + wrap_angle(yaw - self._heading)
        self._heading = yaw
        return yaw

    def _gains(self, yaw: np.ndarray, rate: np.ndarray) -> np.ndarray:
        """Gain of each row, shape (..., n, 7)."""
        keys = np.stack((np.round(yaw / SAME_HEADING), np.round(rate / SAME_RATE)), axis=-1).astype(int)
        rows = [self._gain(int(a), int(b)) for a, b in keys.reshape(-1, 2)]
        return np.stack(rows).reshape(*yaw.shape, -1, 7)

    def _gain(self, heading: int, rate: int) -> np.ndarray:
        """Gain for a heading and a turn rate, in the steps within which they count as the same."""
        if (heading, rate) not in self._known:
            a, b = self.model(heading * SAME_HEADING, rate * SAME_RATE)
            r = self.gains.input * np.eye(b.shape[1])
            self._known[heading, rate] = regulator(a, b, np.diag(self.gains.states), r).gain
        return self._known[heading, rate]

    def model(self, yaw: float, rate: float) -> tuple[np.ndarray, np.ndarray]:
        """Differences through the simulator; place and velocity make no difference to them.

        Args:
            yaw: Heading [rad].
            rate: Turn rate [rad/s].

        Returns:
            A (7, 7) and B (7, n) of x⁺ = A x + B u.
        """
        state = np.array([0.0, 0.0, 0.0, 0.0, np.cos(0.5 * yaw), np.sin(0.5 * yaw), rate])
        steps, closed = np.maximum(LEAST_STEP, state * STEP), np.zeros(len(self._valves.names))
        a = slopes(
            lambda states: self._moved(states, closed[:, None]),
            state - steps,
            state + steps,
            around=state,
            spans=2.0 * steps,
        )
        a[4, 4] = 1.0
        one = np.full(len(closed), STEP)
        b = slopes(
            lambda inputs: self._moved(state[:, None], inputs),
            -SHORT * one,
            one,
            around=closed,
            spans=2.0 * one,
        )
        b[b == 0.0] = INSTEAD_OF_ZERO
        return a, b

    def _moved(self, states: np.ndarray, inputs: np.ndarray) -> np.ndarray:
        """States (7, k) one control step later, under inputs (n, k) that do not share pressure."""
        wrench = self._valves.thrust * inputs.T @ self._valves.wrench_per_newton
        x, y, vx, vy, w, z, rate = np.broadcast_arrays(*states, inputs[0])[:7]
        now, push = PlanarState(x, y, 2.0 * np.arctan2(z, w), vx, vy, rate), tuple(wrench[:, PLANAR].T)
        for _ in range(self.robot.timing.substeps(self.control_hz)):
            now = free_body_step(now, push, STILL, self._world, None, self.robot.timing.physics_dt)
        half = 0.5 * now.yaw
        return np.stack((now.x, now.y, now.vx, now.vy, np.cos(half), np.sin(half), now.yaw_rate))

    def derived(self) -> dict[str, Any]:
        """What else the commands depend on."""
        return super().derived() | {"physics_dt": self.robot.timing.physics_dt}
