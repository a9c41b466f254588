"""The gate before a controller: only believable, fresh measurements pass."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fulmar_core.robot import Limits
from fulmar_core.state import RigidBodyState

FROZEN_AFTER = 10  # repeats of one measurement that no noisy sensor gives
BACK_NS = 1_000_000_000  # further back than this is no reordering: whoever measures has begun again
FORWARD_NS = 10_000_000_000  # further ahead than this is no gap: it is another clock, or one wrong stamp


@dataclass(frozen=True, slots=True)
class Measurement:
    """An odometry message without ROS."""

    stamp_ns: int  # when it was measured
    frame: str
    child_frame: str
    state: RigidBodyState


class InputGate:
    """Checks measurements one after the other.

    A jump of time is told once and begins a new epoch, so that neither a restarted plant nor one wrong stamp shuts
    the gate for ever. `epoch` counts these jumps.
    """

    def __init__(self, limits: Limits, *, frozen_after: int = FROZEN_AFTER) -> None:
        """Check against a robot's limits.

        Args:
            limits: What the robot can possibly do.
            frozen_after: Repeats of one measurement that count as a stuck sensor; 0 never does, as for
                simulated sensors without noise.
        """
        self._limits, self._frozen_after = limits, frozen_after
        self._last: Measurement | None = None
        self._equal = 0
        self.epoch = 0

    def problem(self, measurement: Measurement) -> str | None:
        """What is wrong with a measurement.

        Args:
            measurement: The next one.

        Returns:
            A reason for people, or None if it may be used.
        """
        reason = self._frame_problem(measurement) or self._value_problem(measurement.state)
        if reason is None and self._last is not None:
            reason = self._stamp_problem(measurement, measurement.stamp_ns - self._last.stamp_ns)
        if reason is None:
            reason = self._frozen_problem(measurement)
            self._last = measurement
        return reason

    def forget(self) -> None:
        """Begin anew, as after a time jump that is known."""
        self._last, self._equal = None, 0

    def _frame_problem(self, measurement: Measurement) -> str | None:
        if measurement.frame != "odom" or measurement.child_frame != "base_link":
            return (
                f"odom is '{measurement.frame}' → '{measurement.child_frame}', must be 'odom' → 'base_link'"
            )
        return None

    def _value_problem(self, state: RigidBodyState) -> str | None:
        parts = (
            state.position_in_world,
            state.quat_xyzw,
            state.velocity_in_world,
            state.angular_velocity_in_body,
        )
        # Four numbers at a time, a float does all this in a fifth of an array's time.
        if not all(math.isfinite(value) for part in parts for value in part.tolist()):
            return "odom holds a value that is not finite"
        norm = math.hypot(*state.quat_xyzw.tolist())
        if abs(norm - 1.0) > 0.01:
            return f"odom quaternion has norm {norm:.3f}, must be 1"
        speed = math.hypot(*state.velocity_in_world.tolist())
        if speed > self._limits.speed:
            return f"odom speed {speed:.2f} m/s is beyond the possible {self._limits.speed:g} m/s"
        yaw_rate = abs(float(state.angular_velocity_in_body[2]))
        if yaw_rate > self._limits.yaw_rate:
            return (
                f"odom yaw rate {yaw_rate:.2f} rad/s is beyond the possible {self._limits.yaw_rate:g} rad/s"
            )
        return None

    def _stamp_problem(self, measurement: Measurement, ahead_ns: int) -> str | None:
        if not -BACK_NS <= ahead_ns <= FORWARD_NS:
            self.epoch += 1
            self._last, self._equal = measurement, 0
            return f"odom time jumped by {ahead_ns / 1e9:+.1f} s: a new epoch begins"
        if ahead_ns < 0:
            return f"odom stamp went back by {-ahead_ns / 1e6:.0f} ms"
        return None if ahead_ns else "odom stamp did not advance"

    def _frozen_problem(self, measurement: Measurement) -> str | None:
        if not self._frozen_after:
            return None
        if self._last is not None and _same(self._last.state, measurement.state):
            self._equal += 1
        else:
            self._equal = 0
        if self._equal >= self._frozen_after:
            return f"odom has not changed for {self._equal} messages: the sensor is stuck"
        return None


def _same(a: RigidBodyState, b: RigidBodyState) -> bool:
    return np.array_equal(a.position_in_world, b.position_in_world) and np.array_equal(
        a.quat_xyzw, b.quat_xyzw
    )
