"""Two driven wheels: speed and turn rate over commanded ones.

Commands are speeds, so nothing here has the scale of a force: wheels that are larger than the base believes make every
speed larger by one factor, and a wheel base that is narrower makes turn rates larger by another one.
"""

from __future__ import annotations

import numpy as np

from fulmar_core.robots.actuators.family import Actuators
from fulmar_core.robots.actuators.rolling import SERVO_S
from fulmar_core.robots.robot import Robot
from fulmar_evaluation.identification.drives import Windows
from fulmar_evaluation.identification.held_input import followed, for_each_copy
from fulmar_evaluation.identification.model import IN_PLANE, PLANE_CHANNELS, USEFUL_DELAY_S, Unknown, Values

# A servo has a second, faster lag, and wheels give way a little: which of it looks like delay is open.
SECOND_LAG_S = 0.0025


class WheelModel:
    """Unknowns: factors on speed and turn rate, lag of the wheels' servos, delay."""

    kinds: tuple[int, ...] = IN_PLANE
    channels: tuple[str, ...] = PLANE_CHANNELS
    own = 6
    spans_s: tuple[float, ...] = (3.0, 8.0, 15.0)

    def __init__(self, _robot: Robot, wheels: Actuators) -> None:
        """Prepare for nominal wheels; their limits and slew are taken for true."""
        self._response = response = wheels.response
        self.unknowns: tuple[Unknown, ...] = (
            Unknown("wheel_scale", 1.0, "-"),
            Unknown("turn_scale", 1.0, "-"),
            Unknown("lag", max(response.lag_s, SERVO_S), "s", blur=SECOND_LAG_S),
            Unknown("delay", response.delay_s, "s", positive=False, useful=USEFUL_DELAY_S, blur=SECOND_LAG_S),
        )

    def own_of(self, states: np.ndarray) -> np.ndarray:
        """See `Model.own_of`: pose, speed ahead, slip across (none), turn rate."""
        x, y, yaw, vx, vy, rate = states
        ahead = np.cos(yaw) * vx + np.sin(yaw) * vy
        return np.stack((x, y, yaw, ahead, np.zeros_like(x), rate))

    def predict(self, values: Values, own: np.ndarray, windows: Windows) -> np.ndarray:
        """See `Model.predict`.

        The servos of `rolling_step` without its limits of force, which a run on a floor does not reach: they are linear
        then, and slopes exist everywhere. A simulation may move a whole step with the speed of its end; that is half a
        step too early, and would be taken for delay here.
        """
        targets = for_each_copy(lambda delay: followed(windows, delay, self._response.slew), values["delay"])
        x, y, yaw, speed, _, rate = own
        share = np.minimum(windows.dt / values["lag"], 1.0)
        poses = np.empty((windows.steps + 1, 3, *own.shape[1:]))
        poses[0] = x, y, yaw
        for step in range(windows.steps):
            faster = share * (targets[step, 0] * values["wheel_scale"] - speed)
            turning = share * (targets[step, 1] * values["turn_scale"] - rate)
            mean_speed, mean_rate = speed + 0.5 * faster, rate + 0.5 * turning
            midway = yaw + 0.5 * windows.dt * mean_rate
            x, y = (
                x + windows.dt * mean_speed * np.cos(midway),
                y + windows.dt * mean_speed * np.sin(midway),
            )
            speed, rate, yaw = speed + faster, rate + turning, yaw + windows.dt * mean_rate
            poses[step + 1] = x, y, yaw
        return poses
