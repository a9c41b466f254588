"""Coarse model of a robot on wheels that stops: its servos follow a command that runs down to nothing.

The same servos as in `dynamics/rolling.py`, by steps of half of their time constant; places are complex numbers.
"""

from __future__ import annotations

import numpy as np

from fulmar_core.robots.actuators.rolling import Rolling
from fulmar_core.robots.robot import Robot
from fulmar_core.safety.envelope.lean.commands import done_at
from fulmar_core.safety.envelope.lean.samples import Samples
from fulmar_core.safety.envelope.lean.track import Track
from fulmar_core.states.planar import PlanarState

LAGS = 5.0  # time constants of the servos after which the wheels count as standing


class WheelRollout:
    """Rolls robots on wheels of one kind forward.

    Attributes:
        drift: Speed with which they are carried while they stand: none [m/s].
    """

    drift = 0.0

    def __init__(self, robot: Robot, samples: Samples, dt: float) -> None:
        """Take what the robot's file says; arguments as in `HullRollout`."""
        self._drive, self._dt, self._gain = robot.actuated_by(Rolling), dt, samples.gain[None]
        response = self._drive.response
        steps = max(1, int(np.ceil(dt / max(0.5 * self._drive.servo_s, robot.timing.physics_dt))))
        self._step = dt / steps
        self._late_s = samples.late_s + robot.sensors.odometry.delay_s + response.latest_s
        ramp_s = float((self._drive.scale / response.slew).max()) if response.slew else 0.0
        last_s = float(self._late_s.max()) + dt + ramp_s + LAGS * self._drive.servo_s
        self._stops_from = steps + int(np.ceil(self._late_s.max() / self._step))
        self._times = self._step * (0.5 + np.arange(int(np.ceil(last_s / self._step))))
        self._most = self._drive.pull / (samples.mass * robot.body.mass)[None]
        self._inertia = (samples.inertia * robot.body.inertia[2])[None]

    def track(self, state: PlanarState, previous: np.ndarray, command: np.ndarray) -> Track:
        """Where n robots come to that carry out one step of a command and then stop; see `HullRollout.track`."""
        commands = previous, command, np.zeros_like(command)
        does = done_at(self._times, self._late_s, commands, self._drive.response, self._dt)
        wanted, turns = does[..., 0] * self._gain, does[..., 1] * self._gain
        wide = np.zeros(does.shape[1:3])
        u, _ = state.velocity_in_body
        place, yaw = (state.x + 1j * state.y)[:, None] + wide, state.yaw[:, None] + wide
        speed, rate = u[:, None] + wide, state.yaw_rate[:, None] + wide
        servo_s, dt, places = self._drive.servo_s, self._step, [place]
        fastest = np.zeros(len(u)), np.zeros(len(u))
        for step in range(len(does)):
            speed = speed + dt * np.clip((wanted[step] - speed) / servo_s, -self._most, self._most)
            now = PlanarState(wide, wide, yaw, speed, wide, rate)
            rate = self._drive.next_yaw_rate(now, speed, turns[step], wide, self._inertia, dt)
            yaw = yaw + dt * rate
            place = place + dt * speed * np.exp(1j * yaw)
            places.append(place)
            if step + 1 == self._stops_from:
                fastest = np.abs(rate).max(axis=1), np.abs(speed).max(axis=1)
        return Track(np.stack(places), *fastest)
