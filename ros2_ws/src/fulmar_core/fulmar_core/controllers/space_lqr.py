"""Discrete linear-quadratic regulator for a body in space, of twelve states.

Position, rotation vector to the goal, velocity and turn rate, all in the body's frame: so turned, errors of the
attitude are a vector space near the goal (Solà, arXiv 1711.02508, §4), and one gain serves every attitude. Model, gain
and metric of the allocation come as those of the planar LQR do (`lqr.py`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from fulmar_core.controllers.lqr import regulator
from fulmar_core.controllers.space_frame import SpaceMotion
from fulmar_core.controllers.space_law import SpaceGains, SpaceLaw
from fulmar_core.dynamics.linear_model import linearise_wrench
from fulmar_core.states.attitude import logarithm
from fulmar_core.states.spatial import SpatialState


@dataclass(frozen=True, kw_only=True)
class SpaceLqrWeights(SpaceGains):
    """Weights and limits, as read from `configs/controllers/<robot>_lqr.yaml` of a body in space.

    Costs are per second, so one file serves every command rate.
    """

    position: float  # per m²
    attitude: float  # per rad²
    velocity: float  # per (m/s)²
    rate: float  # per (rad/s)²
    force: float  # per N²
    torque: float  # per (N·m)²
    tracking_velocity: float = 0.0  # as 'velocity', where velocities are the goal; 0: the same
    tracking_rate: float = 0.0  # as 'rate', where turn rates are the goal; 0: the same

    def __post_init__(self) -> None:
        super().__post_init__()
        if min(self.position, self.attitude, self.velocity, self.rate) < 0.0:
            raise ValueError("weights must not be negative.")
        if min(self.force, self.torque) <= 0.0 or min(self.tracking_velocity, self.tracking_rate) < 0.0:
            raise ValueError(
                "'force' and 'torque' must be greater than 0, what is for tracking not negative."
            )


class SpaceLqr(SpaceLaw):
    """LQR on the measured or estimated state; holds the attitude where the task has one."""

    law = "lqr"
    title = "LQR"

    gains: SpaceLqrWeights

    def prepare(self) -> None:
        """Solve for the gain and list the combinations of valves."""
        robot, gains, frame, dt = self.robot, self.gains, self.frame, 1.0 / self.control_hz
        at_rest = SpatialState.at_rest((np.asarray(0.0),) * 3, (*((np.asarray(0.0),) * 3), np.asarray(1.0)))
        model = linearise_wrench(robot, at_rest, np.zeros(6), dt)
        velocity = (frame.tracks and gains.tracking_velocity) or gains.velocity
        rate = (frame.tracks and gains.tracking_rate) or gains.rate
        q = np.repeat((gains.position, gains.attitude, velocity, rate), 3)
        # What has no goal is not a state.
        used = np.flatnonzero(np.repeat((not frame.tracks, frame.heads, True, True), 3))
        a, b = model.a[np.ix_(used, used)], model.b[used]
        best = regulator(a, b, dt * np.diag(q[used]), dt * np.diag(np.repeat((gains.force, gains.torque), 3)))
        self.gain = np.zeros((6, len(q)))
        self.gain[:, used], self._hessian = best.gain, best.hessian
        lead = 1.0 if frame.tracks else self.gain[0, 6] / self.gain[0, 0]
        turn_lead = self.gain[3, 9] / self.gain[3, 3] if frame.heads else 1.0
        self.allocate_by(0.5 * (best.hessian + best.hessian.T), lead=float(lead), turn_lead=float(turn_lead))

    def wrench(self, way: np.ndarray, now: SpaceMotion) -> np.ndarray:
        """See `SpaceLaw.wrench`."""
        turn = self.limited_turn(np.stack(logarithm(now.to_goal), axis=-1))
        errors = np.concatenate((-way, -turn, now.velocity, now.rate), axis=-1)
        wrench = -errors @ self.gain.T
        if self.frame.tracks:  # what keeps the velocity in a turn, and the turn itself
            wrench = wrench + np.concatenate((self.turning_force(now), self.gyroscopic(now)), axis=-1)
        return np.asarray(wrench)

    def derived(self) -> dict[str, Any]:
        """What else the commands depend on."""
        return super().derived() | {
            "gain": np.round(self.gain, 9).tolist(),
            "hessian": np.round(self._hessian, 9).tolist(),
        }
