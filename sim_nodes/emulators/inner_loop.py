"""Inner loops of an emulated autopilot on a fixed wing: from an attitude or turn rates to its surfaces."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from fulmar_core.dynamics.actuators.flight_actuation import FlightActuation
from fulmar_core.dynamics.batch_dynamics import Steps
from fulmar_core.dynamics.flight_dynamics import FlightDynamics
from fulmar_core.dynamics.flight_trim import find_trim, still_air
from fulmar_core.robots.actuators.control_surfaces import ControlSurfaces
from fulmar_core.robots.robot import Robot
from fulmar_core.states.rotation import rotate, rotate_inverse
from fulmar_core.states.spatial import SpatialState
from fulmar_core.states.state import RigidBodyState

KP, KI = 8.0, 6.0  # of turn rates [1/s, 1/s²]: our values, as an autopilot that is tuned has them
ATTITUDE_S = 0.3  # time constant of roll and pitch [s]
MOST_RATE = 1.5  # that the attitude loop asks for [rad/s]
TEST_S, TEST_RAD = 0.01, 0.02  # of the trial that measures what surfaces do
G = 9.80665


class InnerLoop:
    """Turn rates by a PI law around trim, and roll and pitch by turn rates.

    Body axes are ahead, left and up.
    """

    def __init__(self, robot: Robot) -> None:
        """Tune it to an aircraft at its cruising speed."""
        self._actuators, self._speed = robot.actuated_by(ControlSurfaces), robot.wings.speed
        trim = find_trim(robot, self._speed)
        self.trim = np.asarray(trim.command, dtype=float)
        self.pitch = _angles(trim.state.to_rigid())[1]
        self._inverse = np.linalg.pinv(_effects(robot, trim.state[None], self.trim), rcond=0.05)
        self._sum, self._last_s = np.zeros(3), -math.inf

    def by_rates(self, rates: np.ndarray, thrust: float, state: RigidBodyState, now_s: float) -> np.ndarray:
        """Command for turn rates (3,) [rad/s] and a thrust from 0 to 1, at a time of the monotonic clock [s]."""
        error = rates - np.asarray(state.angular_velocity_in_body)
        passed = min(0.1, max(0.0, now_s - self._last_s))
        self._last_s = now_s
        self._sum = np.clip(self._sum + passed * error, -0.5, 0.5)
        surfaces = self._inverse @ (KP * error + KI * self._sum)
        count = self._actuators.positions
        command = np.concatenate((self.trim[:count] + surfaces, [thrust] * len(self._actuators.motors)))
        return np.asarray(self._actuators.limited(command))

    def by_attitude(
        self, roll: float, pitch: float, thrust: float, state: RigidBodyState, now_s: float
    ) -> np.ndarray:
        """Command for roll (right wing down) and pitch (nose up) [rad]; the nose follows the turn."""
        now_roll, now_pitch = _angles(state)
        rolling = np.clip((roll - now_roll) / ATTITUDE_S, -MOST_RATE, MOST_RATE)
        climbing = np.clip((pitch - now_pitch) / ATTITUDE_S, -MOST_RATE, MOST_RATE)
        turning = G * math.tan(np.clip(now_roll, -1.0, 1.0)) / max(self._speed, 1.0)  # to the right
        p = rolling
        q = climbing * math.cos(now_roll) + turning * math.sin(now_roll) * math.cos(now_pitch)
        r = -climbing * math.sin(now_roll) + turning * math.cos(now_roll) * math.cos(now_pitch)
        return self.by_rates(np.array([p, -q, -r]), thrust, state, now_s)

    def level(self, state: RigidBodyState, now_s: float) -> np.ndarray:
        """Command for level flight as in trim."""
        throttle = float(np.mean(self.trim[self._actuators.positions :]))
        return self.by_attitude(0.0, self.pitch, throttle, state, now_s)


def _angles(state: RigidBodyState) -> tuple[float, float]:
    """Roll, right wing down, and pitch, nose up [rad], from where nose and left wing point."""
    nose = rotate(state.quat_xyzw, np.array([1.0, 0.0, 0.0]))
    up = rotate_inverse(state.quat_xyzw, np.array([0.0, 0.0, 1.0]))
    return math.atan2(float(up[1]), float(up[2])), math.asin(max(-1.0, min(1.0, float(nose[2]))))


def _effects(robot: Robot, state: SpatialState, trim: np.ndarray) -> np.ndarray:
    """Turning acceleration by each surface, shape (3, surfaces) [1/s²]."""
    fine = replace(robot, timing=replace(robot.timing, physics_dt=TEST_S, control_hz=1.0 / TEST_S))
    dynamics, still = FlightDynamics(fine, turbulent=False), (np.zeros(1),) * 3
    world: Any = still_air(fine, 1)
    craft = robot.actuated_by(ControlSurfaces)

    def rates(command: np.ndarray) -> np.ndarray:
        actuation = FlightActuation(craft, command[:, None])
        actuation.begin(command[:, None], world, None)
        moved = dynamics.move(state, actuation, world, still, Steps(1))
        return np.asarray(moved[0].to_rigid().angular_velocity_in_body)

    columns = []
    for surface in range(craft.positions):
        one = np.zeros_like(trim)
        one[surface] = TEST_RAD
        columns.append((rates(trim + one) - rates(trim - one)) / (2.0 * TEST_RAD * TEST_S))
    return np.array(columns).T
