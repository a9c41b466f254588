"""Proportional-derivative control of a body in space.

Force −K_p Rᵀ Δp − K_d v and torque −k_R e_R − k_ω ω + ω × J ω, with R_e the rotation from the wanted attitude to the
body's, and e_R the vector of ½ (R_e − R_eᵀ) (Lee, Leok and McClamroch, "Geometric Tracking Control of a Quadrotor UAV
on SE(3)", CDC 2010, eq. 10, 11 and 16, for a goal at rest).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fulmar_core.controllers.space_frame import SpaceMotion
from fulmar_core.controllers.space_law import SpaceGains, SpaceLaw
from fulmar_core.states.attitude import scaled


@dataclass(frozen=True, kw_only=True)
class SpacePdGains(SpaceGains):
    """Gains, as read from `configs/controllers/<robot>_pd.yaml`."""

    position: float  # K_p [N/m]
    velocity: float  # K_d [N·s/m]
    attitude: float  # k_R [N·m/rad]
    rate: float  # k_ω [N·m·s/rad]
    force_error: float  # cost of a force that valves or fans miss [1/N²]
    torque_error: float  # same of a torque [1/(N·m)²]

    def __post_init__(self) -> None:
        super().__post_init__()
        gains = (self.position, self.velocity, self.attitude, self.rate, self.force_error, self.torque_error)
        if min(gains) <= 0.0:
            raise ValueError("all gains must be greater than 0.")


class SpacePd(SpaceLaw):
    """PD law on SE(3) on the measured or estimated state; holds the attitude where the task has one."""

    law = "pd"
    title = "PD on SE(3)"

    gains: SpacePdGains

    def prepare(self) -> None:
        """List the combinations of valves."""
        gains = self.gains
        weight = np.diag(np.repeat((gains.force_error, gains.torque_error), 3)) / self.control_hz
        self.allocate_by(weight, lead=gains.velocity / gains.position, turn_lead=gains.rate / gains.attitude)

    def wrench(self, way: np.ndarray, now: SpaceMotion) -> np.ndarray:
        """See `SpaceLaw.wrench`."""
        gains = self.gains
        # Of the rotation by an angle about an axis e_R has the sine, and the opposite rotation its negative.
        turn = self.limited_turn(np.stack(scaled(2.0 * now.to_goal[3], now.to_goal[:3]), axis=-1))
        force = gains.position * way - gains.velocity * now.velocity
        torque = gains.attitude * turn - gains.rate * now.rate + self.gyroscopic(now)
        if self.frame.tracks:  # what keeps the velocity in a turn
            force = force + self.turning_force(now)
        return np.concatenate((force, torque), axis=-1)
