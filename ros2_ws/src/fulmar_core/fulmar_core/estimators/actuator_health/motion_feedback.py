"""Parts whose work shows in the motion of the robot alone: driven wheels, steering, propellers of a boat."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np

from fulmar_core.dynamics.free_body import free_body_step
from fulmar_core.dynamics.linear_model import nominal_worlds
from fulmar_core.estimators.actuator_health.failed_part import Finding, standard_deviations, unresponsive
from fulmar_core.estimators.actuator_health.modelled_response import ModelledResponse
from fulmar_core.estimators.actuator_health.response_bank import ResponseBank
from fulmar_core.robots.actuators.ackermann import Ackermann
from fulmar_core.robots.actuators.differential_drive import DifferentialDrive
from fulmar_core.robots.actuators.propellers import Propellers
from fulmar_core.robots.robot import Robot
from fulmar_core.states.planar import PlanarState, to_body
from fulmar_core.states.state import RigidBodyState

LOOK_S = 0.1  # least time between two measurements that are compared, [s]
MODEL = 0.1  # share of its value by which the model of a wheel errs [-]
PUSH = 0.1  # force and torque from outside that are no surprise, of what the robot's own can be [-]
GUST = 0.02  # by which these change within a window [-]
PROPELLER_LOOK_S = 0.2  # same, of propellers [s]
ONSETS_S = (0.6, 1.2, 1.8, 2.4, 3.0)  # times since when a propeller may be lost [s]
FADES = 0.7  # share of full thrust from which one that is lost comes to rest, about [-]
ASIDE = 0.05  # steering that is no surprise where none is asked for, of the largest [-]
ROLLS = 0.1  # share of top speed from which steering shows [-]
BLOCKED = "the robot does not move, whatever its wheels are commanded: it is held, blocked or without power"


class MotionFeedback(ABC):
    """Compares how a robot moves with what is applied to its actuators."""

    def __init__(self, robot: Robot, names: tuple[str, ...], bank: ResponseBank) -> None:
        """Begin without findings; `bank` compares the parts of these names."""
        self._names, self._bank, self._model = names, bank, ModelledResponse(robot)
        self.reset()

    def reset(self) -> None:
        """Begin anew."""
        self._model.reset()
        self._bank.reset()
        self._since_s = 0.0

    @property
    def findings(self) -> tuple[Finding, ...]:
        """The part that is believed dead or stuck."""
        return tuple(unresponsive(self._names[part]) for part in self._bank.fault)

    @abstractmethod
    def see(self, command: np.ndarray, seconds: float, motion: RigidBodyState | None) -> None:
        """Take what was applied, shape (n,), for how long [s], and the motion at its end; None: not measured."""


class WheelFeedback(MotionFeedback):
    """Of robots that two numbers drive, which wheels follow with a lag."""

    def reset(self) -> None:
        """Begin anew."""
        super().reset()
        self._modelled = self._before = np.zeros(2)


class DriveFeedback(WheelFeedback):
    """Compares what each side of a base with two driven wheels does with what it is commanded.

    Attributes:
        findings: The wheel that does not drive; or that neither does, which need not be the wheels' fault.
    """

    def __init__(self, robot: Robot) -> None:
        """Begin without findings."""
        self._drive = robot.actuated_by(DifferentialDrive)
        half = 0.5 * self._drive.track
        speed, rate = standard_deviations(robot)
        self._std = float(np.hypot(speed, half * rate))
        self._to_rims = np.array([[1.0, -half], [1.0, half]])
        bank = ResponseBank(2, offsets=np.full(2, self._drive.max_speed), together=True)
        super().__init__(robot, self._drive.parts.names, bank)

    @property
    def findings(self) -> tuple[Finding, ...]:
        """See the class."""
        return (Finding("", BLOCKED),) if len(self._bank.fault) == 2 else super().findings

    def see(self, command: np.ndarray, seconds: float, motion: RigidBodyState | None) -> None:
        """See `MotionFeedback.see`."""
        done = self._model.follow(command, seconds) @ self._to_rims.T
        self._modelled = _lagged(self._modelled, done, seconds, self._drive.servo_s)
        self._since_s += seconds
        if motion is None or self._since_s < LOOK_S - 1e-6:
            return
        twist = np.array([_ahead(motion), float(motion.angular_velocity_in_body[2])])
        rows = np.hstack((np.diag(self._modelled), np.eye(2)))
        errs = np.abs(self._modelled - self._before) + MODEL * np.abs(self._modelled)
        self._bank.add(self._since_s, rows, self._to_rims @ twist, np.hypot(self._std, errs))
        self._before, self._since_s = self._modelled, 0.0


class CarFeedback(WheelFeedback):
    """Compares speed and curvature of a car with its commands.

    Attributes:
        findings: Drive or steering, where they do not follow.
    """

    def __init__(self, robot: Robot) -> None:
        """Begin without findings."""
        self._car = robot.actuated_by(Ackermann)
        self._std = standard_deviations(robot)
        self._rolls = ROLLS * robot.performance.top_speed
        most = self._car.scale
        bank = ResponseBank(2, offsets=most, aside=np.array([1e-3 * most[0], ASIDE * most[1]]))
        super().__init__(robot, self._car.parts.names, bank)

    def see(self, command: np.ndarray, seconds: float, motion: RigidBodyState | None) -> None:
        """See `MotionFeedback.see`."""
        done = self._model.follow(command, seconds)
        speed = _lagged(self._modelled[:1], done[:, :1], seconds, self._car.servo_s)[0]
        self._modelled = np.array([speed, done[-1, 1] if len(done) else self._modelled[1]])
        self._since_s += seconds
        if motion is None or self._since_s < LOOK_S - 1e-6:
            return
        ahead, long = _ahead(motion), self._car.wheelbase
        turned = ahead * np.tan(self._modelled[1])
        changes = np.abs(self._modelled - self._before)
        rows = np.array([[speed, 0.0, 1.0, 0.0], [0.0, turned, 0.0, ahead]])
        values = np.array([ahead, long * float(motion.angular_velocity_in_body[2])])
        errs = changes * np.array([1.0, abs(ahead)]) + MODEL * np.abs([speed, turned])
        std = np.hypot(np.array(self._std) * np.array([1.0, long]), errs)
        rolls = abs(ahead) > self._rolls
        self._bank.add(self._since_s, rows[: 1 + rolls], values[: 1 + rolls], std[: 1 + rolls])
        self._before, self._since_s = self._modelled, 0.0


class PropellerFeedback(MotionFeedback):
    """Compares how a boat speeds up and turns with the thrust of its propellers.

    A push of wind or current is estimated beside what each propeller gives.

    Attributes:
        findings: Propellers that give nothing, or a thrust that does not follow their command.
    """

    def __init__(self, robot: Robot) -> None:
        """Begin without findings."""
        self._robot, self._propellers = robot, robot.actuated_by(Propellers)
        self._world = nominal_worlds(robot, 1)
        self._std = np.array(standard_deviations(robot))
        added = robot.hydrodynamics.planar_added_mass if robot.hydrodynamics is not None else (0.0, 0.0, 0.0)
        self._inertia = np.array([robot.body.mass + added[0], robot.body.inertia[2] + added[2]])
        able = np.array([robot.performance.force, robot.performance.torque])
        count, slew = len(robot.actuators.names), robot.actuators.response.slew
        fades_s = FADES / min(slew) if slew else 0.0
        most = np.full(count, np.abs(self._propellers.curve).max())
        bank = ResponseBank(
            count,
            offsets=most,
            pushes=PUSH * able,
            changes=GUST * able,
            adds_up=True,
            onsets_s=ONSETS_S,
            fades_s=fades_s,
        )
        super().__init__(robot, self._propellers.names, bank)

    def reset(self) -> None:
        """Begin anew."""
        super().reset()
        self._before: PlanarState | None = None
        self._impulses = np.zeros(len(self._names))

    def see(self, command: np.ndarray, seconds: float, motion: RigidBodyState | None) -> None:
        """See `MotionFeedback.see`."""
        done = self._model.follow(command, seconds)
        if len(done):
            self._impulses = self._impulses + (seconds / len(done)) * self._propellers.thrusts(done).sum(
                axis=0
            )
        self._since_s += seconds
        if motion is None:
            return
        now = PlanarState.from_rigid(motion)
        if self._before is not None:
            if self._since_s < PROPELLER_LOOK_S - 1e-6:
                return
            self._compare(self._before, now)
        self._before, self._since_s = now, 0.0
        self._impulses = np.zeros(len(self._names))

    def _compare(self, before: PlanarState, now: PlanarState) -> None:
        """Compare two motions with the thrust between them."""
        none = (np.zeros(1),) * 3
        start = before.mapped(np.atleast_1d)
        adrift = free_body_step(start, none, none, self._world, self._robot.hydrodynamics, self._since_s)
        ahead, _ = to_body(now.yaw, now.vx - adrift.vx[0], now.vy - adrift.vy[0])
        gained = np.array([float(ahead), float(now.yaw_rate - adrift.yaw_rate[0])])
        work = np.stack(
            (np.ones_like(self._impulses), self._propellers.lever_arms)
        )  # force and moment of 1 N
        rows = np.hstack((work * self._impulses, work * self._since_s, np.eye(2) * self._since_s))
        self._bank.add(self._since_s, rows / self._inertia[:, None], gained, self._std)


def _ahead(motion: RigidBodyState) -> float:
    """Speed ahead [m/s]."""
    velocity = motion.velocity_in_world
    return float(to_body(motion.yaw, velocity[0], velocity[1])[0])


def _lagged(before: np.ndarray, targets: np.ndarray, seconds: float, lag_s: float) -> np.ndarray:
    """Values after a lag of first order has followed targets of equal length, shape (k, n), for a time [s]."""
    values = before
    for target in targets:
        keep = np.exp(-seconds / (len(targets) * lag_s))
        values = target + keep * (values - target)
    return np.asarray(values)
