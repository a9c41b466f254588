"""Whether a body answers its commands as the envelope guard believes: with enough thrust, and in time.

The change of velocity and of turn rate over a control step is fitted, by least squares that forget, to what the three
newest commands would have made of them in that step. The sum of the three shares is the thrust over the nominal one,
and the later ones say how late commands act, whether the actuators or the odometry delays them. Translation and
rotation are fitted apart: the one depends on the mass, the other on the inertia. What actuators with a lag or a slew
limit do depends on more commands; these are not checked.
"""

from __future__ import annotations

import numpy as np

from fulmar_core.robots.actuators.pushing import Pushing
from fulmar_core.robots.robot import Robot
from fulmar_core.safety.envelope.braking import Beliefs, Braking
from fulmar_core.safety.envelope.dead_check import NONE, DeadCheck
from fulmar_core.safety.envelope.motion import Motion, crossed, in_world
from fulmar_core.safety.envelope.response_fit import COMMANDS, Fitted, ManyFit, SingleFit
from fulmar_core.states.state import RigidBodyState

SIGMAS = 2.5  # of certainty before the guard says so
NOISE = 1.0  # of what is measured, in standard deviations of the odometry's
SLACK_S = 0.02  # of the delay beyond the beliefs, for what the fit leaves out [s]
WEAKEST = 0.5  # that thrust is taken for, as a share of the least that is believed [-]
SOUND, WEAK, SLOW, DEAD = 0, 1, 2, 3  # what is found
WORDS = {
    DEAD: "gives no thrust: the body may not stop where the guard believes",
    WEAK: "the body gains less speed than its thrust should give it: it may not stop where the guard believes",
    SLOW: "commands act later than the guard believes: it may not stop where the guard believes",
}


class ResponseCheck:
    """Checks n bodies of one kind step by step.

    Attributes:
        parts: Knows an actuator that is dead; None in the plane, and where motion does not show it.
        strength: Of the thrust, as a share of the least that is believed, at most 1, shape (n,) [-].
    """

    def __init__(self, robot: Robot, motion: Motion, beliefs: Beliefs, braking: Braking, dt: float) -> None:
        """Take what is believed.

        Args:
            robot: One that floats.
            motion: Of it.
            beliefs: How far it may differ from its file.
            braking: What follows from them.
            dt: Time of a control step [s].
        """
        self._motion, self._dt, body = motion, dt, robot.body
        self._inertia = body.inertia_matrix
        odometry = robot.sensors.odometry
        pushed, twisted = (
            braking.pushed * dt,
            beliefs.torque * robot.performance.torque / body.inertia[2] * dt,
        )
        noise = NOISE * np.sqrt(2.0)
        self._deviation = np.array(
            (noise * odometry.velocity.std + pushed + 1e-4, noise * odometry.yaw_rate.std + twisted + 1e-4)
        )[:, None, None]
        push = beliefs.push * robot.performance.force / robot.actuated_by(Pushing).full_thrust.max()
        moves, turns = (
            beliefs.thrust / beliefs.mass - push,
            beliefs.thrust / beliefs.inertia - beliefs.torque,
        )
        self._least = np.array(((moves,), (turns,)))
        self._latest_s = braking.late_s + SLACK_S
        self._fits = not robot.actuators.response.remembers
        self.parts: DeadCheck | None = None
        if self._fits:
            deviation = self._deviation.ravel()
            self.parts = DeadCheck(robot, motion, beliefs, deviation, dt, self._latest_s)
        self.reset(1)

    def reset(self, count: int) -> None:
        """Forget everything; there are so many bodies."""
        self._before: tuple[RigidBodyState, np.ndarray] | None = None
        self._sound = self._latest = np.zeros(count, dtype=int)
        self._stamp_ns = 0
        self._wrenches: list[tuple[np.ndarray, np.ndarray]] = []  # of the newest commands, the newest first
        self.strength = np.ones(count)
        if self.parts is not None:
            self.parts.reset(count)
        self._fit: SingleFit | ManyFit = SingleFit() if count == 1 else ManyFit(count)
        none = np.zeros((2, count))
        self._fitted = Fitted(none + 1.0, none + 1.0, none, none)

    def see(self, now: RigidBodyState, middle: np.ndarray, previous: np.ndarray, stamp_ns: int) -> np.ndarray:
        """Take a measurement.

        Args:
            now: State now, of n bodies.
            middle: Attitude half a step later if the body turns on, shape (n, 4).
            previous: Command since the step before, shape (n, m).
            stamp_ns: When it was measured [ns].

        Returns:
            What is found: one of SOUND, WEAK, SLOW and DEAD, shape (n,).
        """
        count = len(now.position_in_world)
        if len(self.strength) != count:
            self.reset(count)
        before, passed_s = self._before, (stamp_ns - self._stamp_ns) / 1e9
        self._before, self._stamp_ns = (now, middle), stamp_ns
        if before is None or abs(passed_s - self._dt) > 0.1 * self._dt:
            self._wrenches = []
            if self.parts is not None:
                self.parts.pause()
            return self._sound
        if not self._fits:
            return self._sound
        self._wrenches = [self._motion.wrench(previous), *self._wrenches][:COMMANDS]
        if len(self._wrenches) == COMMANDS or self.parts is not None:
            change = self._change(before[0], now)
            if self.parts is not None:
                self.parts.see(before[1], change, previous)
            if len(self._wrenches) == COMMANDS:
                columns = self._columns(before[1])
                self._fitted = self._fit.add(columns / self._deviation[..., None], change / self._deviation)
                self._latest = self._found()
        return self._latest

    def _change(self, before: RigidBodyState, now: RigidBodyState) -> np.ndarray:
        """Change of the velocity, and of the turn rate less what tumbling makes of it, shape (2, n, 3)."""
        rate, later = before.angular_velocity_in_body, now.angular_velocity_in_body
        between = 0.5 * (rate + later)
        tumble = -self._dt * crossed(between, between @ self._inertia) @ self._motion.turning
        return np.array((now.velocity_in_world - before.velocity_in_world, later - rate - tumble))

    def _columns(self, middle: np.ndarray) -> np.ndarray:
        """What the newest commands would have made of a step, shape (2, commands, n, 3) [m/s], [rad/s]."""
        motion, dt = self._motion, self._dt
        pushes = [in_world(middle, force) for force, _ in self._wrenches]
        turns = [moment for _, moment in self._wrenches]
        return np.array((np.array(pushes) * (dt / motion.mass), dt * np.array(turns) @ motion.turning))

    def _found(self) -> np.ndarray:
        """See `see`."""
        its, parts = self._fitted, self.parts
        strength = (its.gain / self._least).min(axis=0)
        if parts is not None and parts.found:
            strength = np.minimum(strength, parts.strength)
        self.strength = np.minimum(np.maximum(strength, WEAKEST), 1.0)
        weak = its.gain + SIGMAS * its.unsure < self._least
        slow = self._dt * (its.late - SIGMAS * its.vary) > self._latest_s
        if not (slow.any() or weak.any() or (parts is not None and parts.found)):
            return self._sound
        odd = np.where(slow.any(axis=0), SLOW, np.where(weak.any(axis=0), WEAK, SOUND))
        return odd if parts is None else np.where(parts.dead != NONE, DEAD, odd)

    @property
    def delay_s(self) -> np.ndarray:
        """How late commands act, as the part that knows it better says, shape (n,) [s]."""
        its = self._fitted
        best = np.take_along_axis(its.late, its.vary.argmin(axis=0)[None], axis=0)[0]
        return np.asarray(self._dt * best.clip(0.0, COMMANDS - 1.0))
