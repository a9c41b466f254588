"""Proportional-derivative control of a satellite's attitude, with the inertia of its file or an estimated one."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fulmar_core.controllers.attitude_law import AttitudeGains, AttitudeLaw
from fulmar_core.controllers.controller import INERTIA, Inputs
from fulmar_core.controllers.space_frame import SpaceMotion
from fulmar_core.robots.actuators.reaction_wheels import ReactionWheels
from fulmar_core.robots.robot import Robot

BANDWIDTH = 0.3  # of the closed loop, at most; our value [rad/s]
PRECISION = math.radians(2.0)  # error at which the full torque is asked for at least [rad]
MOMENTUM = 0.4  # share of a wheel's momentum that a slew may take [-]


@dataclass(frozen=True, kw_only=True)
class AttitudePdGains(AttitudeGains):
    """Gains, as read from `configs/controllers/<robot>_pd.yaml`; they are scaled with the inertia."""

    bandwidth: float  # ω_n: the torque is J ω_n² per rad [rad/s]
    damping: float  # ζ: and 2 ζ ω_n J per rad/s [-]
    stray: float = 0.3  # share of the file's inertia by which an estimated one may differ from it at most [-]

    def __post_init__(self) -> None:
        super().__post_init__()
        if min(self.bandwidth, self.damping) <= 0.0 or not 0.0 <= self.stray < 1.0:
            raise ValueError("bandwidth and damping must be greater than 0, 'stray' from 0 to below 1.")


class AttitudePd(AttitudeLaw):
    """Torque J (ω_n² θ − 2 ζ ω_n ω): the same motion whatever the inertia."""

    law = "pd"
    title = "PD of the attitude"

    gains: AttitudePdGains

    def torque(self, turn: np.ndarray, now: SpaceMotion, inertia: np.ndarray) -> np.ndarray:
        """See `AttitudeLaw.torque`."""
        gains = self.gains
        turning = gains.bandwidth**2 * turn - 2.0 * gains.damping * gains.bandwidth * now.rate
        return np.asarray(turning @ inertia)


class AdaptiveAttitude(AttitudePd):
    """The same with the newest estimate of the inertia, as far as it may stray from that of the file."""

    law = "adaptive"
    title = "PD of the attitude with the estimated inertia"
    readings = (*AttitudeLaw.readings, INERTIA)

    def inertia_of(self, inputs: Inputs) -> np.ndarray:
        """The estimate, each entry no farther from the file's than `stray` allows."""
        estimated = inputs.readings.get(INERTIA)
        if estimated is None:
            return self.inertia
        diagonal = np.sqrt(np.diag(self.inertia))
        most = self.gains.stray * np.outer(diagonal, diagonal)
        return np.asarray(self.inertia + np.clip(estimated - self.inertia, -most, most))


def attitude_pd_gains(robot: Robot) -> AttitudePdGains:
    """Gains of a satellite without a file: as fast as its wheels allow, and no slew faster than its tasks ask for."""
    bandwidth, rate = attitude_bandwidth(robot)
    return AttitudePdGains(
        bandwidth=bandwidth, damping=1.0, attitude_error_limit_deg=math.degrees(2.0 * rate / bandwidth)
    )


def attitude_bandwidth(robot: Robot) -> tuple[float, float]:
    """Bandwidth of the closed loop, and turn rate of slews [rad/s]."""
    wheels = robot.actuated_by(ReactionWheels)
    largest = float(np.linalg.eigvalsh(robot.body.inertia_matrix)[-1])
    bandwidth = min(BANDWIDTH, math.sqrt(wheels.torque / (PRECISION * largest)))
    return bandwidth, min(robot.performance.yaw_rate, MOMENTUM * wheels.top_momentum / largest)
