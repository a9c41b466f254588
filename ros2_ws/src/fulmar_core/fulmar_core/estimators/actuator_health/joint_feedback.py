"""Joints that are measured one by one: surfaces and throttles of aircraft, speeds of reaction wheels."""

from __future__ import annotations

from collections import deque
from operator import itemgetter

import numpy as np

from fulmar_core.estimators.actuator_health.failed_part import Finding, dead, stuck, unresponsive
from fulmar_core.estimators.actuator_health.modelled_response import ModelledResponse
from fulmar_core.estimators.actuator_health.response_bank import ResponseBank
from fulmar_core.robots.actuators.control_surfaces import is_throttle
from fulmar_core.robots.actuators.reaction_wheels import ReactionWheels
from fulmar_core.robots.robot import Robot

LATE_S = 0.15  # by which a joint may follow later or sooner than its model [s]
GAIN = 0.2  # share of its command by which it may stand nearer to neutral [-]
MODEL = 0.05  # share of its full travel by which a model errs [-]
NOISE = 4.0  # standard deviations of its sensor that are no deviation [-]
OFF_S = 0.4  # deviation that lasts so long is a failure [s]
AGREES_S = 2.0  # and agreement for so long ends it [s]
STANDS_S = 0.2  # time in which it must have stood [s]
IDLES = 0.1  # level below which a motor gives nothing that counts [-]
STANDS = 0.02  # share of full travel within which a joint stands [-]


class SurfaceFeedback:
    """Compares measured deflections and thrust levels with a model of servos and motors.

    Attributes:
        names: Of the joints.
        findings: Joints that do not follow, in the order of the actuators.
    """

    SENSOR, VALUES = "surfaces", "positions"  # the reading that it takes, and the numbers in it

    def __init__(self, robot: Robot) -> None:
        """Begin without findings."""
        sensor = robot.sensors.specs["surfaces"]
        self.names, self._scale = robot.actuators.names, robot.actuators.scale
        noise = NOISE * (sensor.std + sensor.quantum)
        self._off = MODEL * self._scale + noise
        self._stands = STANDS * self._scale + noise
        self._model = ModelledResponse(robot)
        self.reset()

    def reset(self) -> None:
        """Begin anew."""
        self._model.reset()
        self._recent: deque[tuple[float, np.ndarray]] = deque()  # age is the sum of the lengths after it
        self._seen: deque[tuple[float, np.ndarray]] = deque()
        self._off_s = np.zeros(len(self.names))
        self._found: dict[str, Finding] = {}
        self._begun = False

    @property
    def findings(self) -> tuple[Finding, ...]:
        """See the class."""
        return tuple(self._found[name] for name in self.names if name in self._found)

    def see(self, command: np.ndarray, seconds: float, positions: np.ndarray | None) -> None:
        """Take what was applied, and what was measured at the end.

        Args:
            command: Shape (n,).
            seconds: For how long it was applied [s].
            positions: Shape (n,), NaN for what is not measured; None between two measurements [rad, -].
        """
        if not self._begun:
            if positions is None:
                return
            self._model.hold(np.where(np.isfinite(positions), positions, command))
            self._begun = True
        done = self._model.follow(command, seconds)
        self._recent.extend((seconds / len(done), modelled) for modelled in done)
        _keep(self._recent, LATE_S)
        if positions is None or not self._recent:
            return
        self._seen.append((seconds, positions))
        _keep(self._seen, STANDS_S)
        recent = np.array([modelled for _, modelled in self._recent])
        low, high = recent.min(axis=0), recent.max(axis=0)
        low = np.minimum(low, (1.0 - GAIN) * low) - self._off
        high = np.maximum(high, (1.0 - GAIN) * high) + self._off
        measured = np.isfinite(positions)
        off = measured & ((positions < low) | (positions > high))
        self._off_s = np.where(off, np.maximum(self._off_s, 0.0) + seconds, self._off_s)
        self._off_s = np.where(measured & ~off, np.minimum(self._off_s, 0.0) - seconds, self._off_s)
        self._note()

    def _note(self) -> None:
        if not self._found and self._off_s.max() <= OFF_S:
            return
        seen = np.stack([positions for _, positions in self._seen])
        span = seen.max(axis=0) - seen.min(axis=0)
        for i, name in enumerate(self.names):
            if self._off_s[i] < -AGREES_S:
                self._found.pop(name, None)
            if self._off_s[i] <= OFF_S or name in self._found:
                continue
            if span[i] <= 2.0 * self._stands[i]:
                self._found[name] = self._stuck(i, float(seen[:, i].mean()))
            elif self._off_s[i] > 2.0 * OFF_S:
                self._found[name] = unresponsive(name)

    def _stuck(self, number: int, where: float) -> Finding:
        name = self.names[number]
        if not is_throttle(name):
            return stuck(name, where, "rad")
        return dead(name) if where <= IDLES else stuck(name, where, "")


LOOK_S = 0.1  # least time between two speeds that are compared [s]
ERRS = 0.05  # share of a change of speed by which its model errs [-]
FRICTION, CHANGES = 0.003, 0.0005  # torque that no model explains, and its changes, of full torque [-]


class ReactionWheelFeedback:
    """Compares how wheels speed up with the torques of their motors.

    Attributes:
        names: Of the wheels.
        findings: Wheels whose speed does not follow the torque.
    """

    SENSOR, VALUES = "wheels", "speeds"  # the reading that it takes, and the numbers in it

    def __init__(self, robot: Robot) -> None:
        """Begin without findings."""
        self._wheels, sensor = robot.actuated_by(ReactionWheels), robot.sensors.specs["wheels"]
        self.names = self._wheels.wheel_names
        self._std = np.array([np.sqrt(2.0) * max(sensor.std + sensor.quantum, 1e-6 * self._wheels.top_speed)])
        self._model = ModelledResponse(robot)
        most = np.array([self._wheels.torque / self._wheels.spin_inertia])
        self._banks = [
            ResponseBank(
                1, offsets=most, pushes=FRICTION * most, changes=CHANGES * most, sticks=False, adds_up=True
            )
            for _ in self._wheels.wheels
        ]
        self.reset()

    def reset(self) -> None:
        """Begin anew."""
        self._model.reset()
        for bank in self._banks:
            bank.reset()
        self._before: np.ndarray | None = None
        self._since_s = 0.0
        self._impulse, self._friction = np.zeros(self._wheels.count), np.zeros(self._wheels.count)

    @property
    def findings(self) -> tuple[Finding, ...]:
        """See the class."""
        named = zip(self.names, self._banks, strict=True)
        return tuple(dead(name) for name, bank in named if bank.fault)

    def see(self, command: np.ndarray, seconds: float, speeds: np.ndarray | None) -> None:
        """Take what was applied, and the speeds at its end, shape (count,); None between two measurements [rad/s]."""
        wheels, count = self._wheels, self._wheels.count
        done = self._model.follow(command, seconds)
        if self._before is not None and len(done):
            dt = seconds / len(done)
            for torques in done[:, :count]:
                self._impulse = self._impulse + dt * wheels.motor_torque(torques, self._before, dt)
                self._friction = self._friction + dt * wheels.friction_torque(self._before)
            self._since_s += seconds
        if speeds is None or (self._before is not None and self._since_s < LOOK_S - 1e-6):
            return
        if self._before is not None:
            expected = self._impulse / wheels.spin_inertia
            change = speeds - self._before - self._friction / wheels.spin_inertia
            for i, bank in enumerate(self._banks):
                rows = np.array([[expected[i], self._since_s, self._since_s]])
                std = np.hypot(self._std, ERRS * expected[i : i + 1])
                bank.add(self._since_s, rows, change[i : i + 1], std)
        self._before = np.array(speeds, dtype=float)
        self._since_s, self._impulse, self._friction = 0.0, np.zeros(count), np.zeros(count)


def _keep(recent: deque[tuple[float, np.ndarray]], window_s: float) -> None:
    """Forget what is older than a window [s], but for the newest."""
    while len(recent) > 1 and sum(map(itemgetter(0), recent)) - recent[0][0] > window_s:
        recent.popleft()
