"""Gate before a controller: only believable, fresh measurements pass."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fulmar_core.robots.robot import Limits, Robot
from fulmar_core.robots.sensors.odometer import OdometrySpec
from fulmar_core.robots.sensors.repetition import FROZEN_AFTER, RepetitionCheck
from fulmar_core.safety.motion_agreement import MotionAgreement
from fulmar_core.states.spatial import SpatialState
from fulmar_core.states.state import RigidBodyState
from fulmar_core.wires.reading import BACK_NS, FORWARD_NS

JUMP_M = 1.0  # beyond what speed explains: a correction of a fix or of a filter is less
FROZEN = "odom does not change: its source is stuck"
CONTRADICTION = (
    "odom contradicts itself: its pose does not move as its twist says. One of them stands or drifts"
)

PLACE = ("position", "velocity")  # parts of odometry that a robot needs which moves from place to place
TURNING = ("attitude", "turn rate")  # that every robot needs


@dataclass(frozen=True, slots=True)
class Measurement:
    """An odometry message without ROS."""

    stamp_ns: int  # when it was measured
    frame: str
    child_frame: str
    state: RigidBodyState
    lacks: tuple[str, ...] = ()  # of PLACE and TURNING: what its source says that it does not know


class InputGate:
    """Checks measurements one after the other.

    A jump of time or place is reported once and begins a new epoch, so that neither a restarted plant nor one wrong
    stamp shuts the gate for ever. `epoch` counts these jumps.

    Attributes:
        warning: What is wrong with the source of the measurements now, in words that stay the same; empty if nothing.
    """

    def __init__(
        self,
        limits: Limits,
        *,
        frozen_after: int = FROZEN_AFTER,
        jump_m: float = math.inf,
        turns_freely: bool = False,
        turns_only: bool = False,
        odometry: OdometrySpec | None = None,
    ) -> None:
        """Check against a robot's limits.

        Args:
            limits: What the robot can possibly do.
            frozen_after: Repeats of one measurement that count as a stuck sensor; 0 never does, as for
                simulated sensors without noise.
            jump_m: So much further from the last place than the highest speed explains is a jump; infinite where
                episodes may begin anywhere [m].
            turns_freely: Whether the robot turns about any axis; the limit then counts for the length of its turn rate.
            turns_only: Whether nothing moves the robot from its place, which its source then need not know.
            odometry: How noisy the source is, where its pose must move as its twist says; once it did not, it is
                refused until both show a motion. None: it need not.
        """
        self._needs = TURNING if turns_only else (*PLACE, *TURNING)
        self._turns_freely = turns_freely
        self._limits, self._jump_m = limits, jump_m
        self._repetition = RepetitionCheck(after=frozen_after)
        self._agreement = MotionAgreement(odometry) if odometry is not None else None
        self._contradicts = False
        self._last: Measurement | None = None
        self.epoch, self.warning = 0, ""

    def problem(self, measurement: Measurement) -> str | None:
        """Reason, for people, why the next measurement is rejected; None if it may be used."""
        reason = (
            self._frame_problem(measurement)
            or self._lack_problem(measurement)
            or self._value_problem(measurement.state)
        )
        if reason is None and self._last is not None:
            reason = self._stamp_problem(measurement, measurement.stamp_ns - self._last.stamp_ns)
        if reason is None:
            frozen, contradiction = self._frozen_problem(measurement), self._contradiction(measurement)
            reason = frozen or contradiction
            self.warning = (FROZEN if frozen else contradiction) or ""
            self._last = measurement
        return reason

    def forget(self) -> None:
        """Begin anew, as after a time jump that is known."""
        self._last = None
        self._forget_source()

    def _frame_problem(self, measurement: Measurement) -> str | None:
        if measurement.frame != "odom" or measurement.child_frame != "base_link":
            return (
                f"odom is '{measurement.frame}' → '{measurement.child_frame}', must be 'odom' → 'base_link'"
            )
        return None

    def _lack_problem(self, measurement: Measurement) -> str | None:
        lacks = [part for part in measurement.lacks if part in self._needs]
        if lacks:
            return f"odom has no {' and no '.join(lacks)}: the covariance of its source says so by -1"
        return None

    def _value_problem(self, state: RigidBodyState) -> str | None:
        # Four numbers at a time, a float does all this in a fifth of an array's time.
        quat, velocity = state.quat_xyzw.tolist(), state.velocity_in_world.tolist()
        turning = state.angular_velocity_in_body.tolist()
        if not all(map(math.isfinite, (*state.position_in_world.tolist(), *quat, *velocity, *turning))):
            return "odom holds a value that is not finite"
        norm = math.hypot(*quat)
        if abs(norm - 1.0) > 0.01:
            return f"odom quaternion has norm {norm:.3f}, must be 1"
        speed = math.hypot(*velocity)
        if speed > self._limits.speed:
            return f"odom speed {speed:.2f} m/s is beyond the possible {self._limits.speed:g} m/s"
        rate, what = (
            (math.hypot(*turning), "turn rate") if self._turns_freely else (abs(turning[2]), "yaw rate")
        )
        if rate > self._limits.yaw_rate:
            return f"odom {what} {rate:.2f} rad/s is beyond the possible {self._limits.yaw_rate:g} rad/s"
        return None

    def _stamp_problem(self, measurement: Measurement, ahead_ns: int) -> str | None:
        if not -BACK_NS <= ahead_ns <= FORWARD_NS:
            return self._new_epoch(measurement, f"odom time jumped by {ahead_ns / 1e9:+.1f} s")
        if ahead_ns < 0:
            return f"odom stamp went back by {-ahead_ns / 1e6:.0f} ms"
        return self._place_problem(measurement, ahead_ns) if ahead_ns else "odom stamp did not advance"

    def _place_problem(self, measurement: Measurement, ahead_ns: int) -> str | None:
        assert self._last is not None
        way = measurement.state.position_in_world - self._last.state.position_in_world
        distance = math.hypot(*way.tolist())
        if distance <= self._limits.speed * ahead_ns / 1e9 + self._jump_m:
            return None
        return self._new_epoch(
            measurement, f"odom place jumped by {distance:.1f} m within {ahead_ns / 1e6:.0f} ms"
        )

    def _new_epoch(self, measurement: Measurement, reason: str) -> str:
        self.epoch += 1
        self._last = measurement
        self._forget_source()
        self._is_frozen(measurement)
        self._contradiction(measurement)
        return f"{reason}: a new epoch begins"

    def _forget_source(self) -> None:
        self._repetition.forget()
        self._contradicts, self.warning = False, ""
        if self._agreement is not None:
            self._agreement.forget()

    def _contradiction(self, measurement: Measurement) -> str | None:
        if self._agreement is None:
            return None
        if not self._agreement.agrees(measurement.stamp_ns, measurement.state):
            self._contradicts = True
            self._agreement.forget()  # what follows must prove itself
        elif self._agreement.proves:
            self._contradicts = False
        return CONTRADICTION if self._contradicts else None

    def _frozen_problem(self, measurement: Measurement) -> str | None:
        if not self._is_frozen(measurement):
            return None
        return f"odom has not changed for {self._repetition.repeats} messages: the sensor is stuck"

    def _is_frozen(self, measurement: Measurement) -> bool:
        pose = np.concatenate((measurement.state.position_in_world, measurement.state.quat_xyzw))
        return self._repetition.see(pose, measurement.stamp_ns)


def helper_gate(robot: Robot) -> InputGate:
    """The gate of a node that gives goals by odometry; controllers check for stuck sensors."""
    return InputGate(
        robot.limits,
        frozen_after=0,
        turns_freely=robot.state_type is SpatialState,
        turns_only=robot.actuators.turns_only,
    )
