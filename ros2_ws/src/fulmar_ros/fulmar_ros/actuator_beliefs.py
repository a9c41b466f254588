"""What a controller node believes of its robot's actuators: of its controller's estimator and of its own monitor."""

from __future__ import annotations

from fulmar_core.estimators.actuator_health.applied import AppliedHistory
from fulmar_core.estimators.actuator_health.beliefs import BeliefReader, Beliefs, joined
from fulmar_core.estimators.actuator_health.fault_monitor import FaultMonitor
from fulmar_core.estimators.actuator_health.hypotheses import can_monitor
from fulmar_core.estimators.actuator_health.losses import Losses
from fulmar_core.estimators.actuator_health.motion_monitor import MotionMonitor
from fulmar_core.estimators.actuator_health.thruster_health import Health, can_estimate_health
from fulmar_core.loop.controller_settings import ControllerSettings
from fulmar_core.robots.robot import Robot
from fulmar_core.safety.input_gate import Measurement


class ActuatorBeliefs:
    """Beliefs about valves, fans, driven wheels and propellers, whatever controls them; none about other actuators.

    Attributes:
        hopeless: Whether no pose can be held without those that are believed dead.
    """

    def __init__(self, robot: Robot, settings: ControllerSettings, applied: AppliedHistory) -> None:
        """Begin with sound actuators; `applied` is what they did."""
        self._reader = BeliefReader(robot) if can_estimate_health(robot) else None
        self._monitor = self._losses = None
        self.hopeless = False
        if can_monitor(robot):
            hz = settings.control_rate(robot)
            self._monitor = FaultMonitor(robot, applied, control_hz=hz, lockstep=settings.lockstep)
            self._losses = Losses(robot, waits=settings.lockstep)
        motion = MotionMonitor(robot, applied)
        self._motion = motion if motion.watches else None
        self._estimated = Beliefs()
        self._epoch = 0

    def forget_estimate(self) -> None:
        """Forget what a controller believed that acts no more."""
        self._estimated = Beliefs()

    def take_estimate(self, health: Health) -> None:
        """Take what the controller's estimator believes of one robot."""
        if self._reader is not None:
            self._estimated = self._reader.read(health)

    def of(self, measurement: Measurement, *, epoch: int, stands: bool) -> Beliefs:
        """Take a measurement.

        Args:
            measurement: Of the robot.
            epoch: Jumps of time or place so far.
            stands: Whether no air carries the robot, so that its motion shows nothing.

        Returns:
            What is believed after it.
        """
        if self._motion is not None:
            if epoch != self._epoch:
                self._motion.reset()
                self._epoch = epoch
            self._motion.take(measurement.state, measurement.stamp_ns)
            return self._motion.beliefs
        if self._monitor is None or self._losses is None:
            return self._estimated
        if stands or epoch != self._epoch:
            self._monitor.reset()
            self._epoch = epoch
        if not stands:
            self._monitor.take(measurement.state, measurement.stamp_ns)
        believed = joined(self._estimated, self._monitor.beliefs, self._monitor.suspects)
        self.hopeless = self._losses.hopeless(believed.dead, measurement.stamp_ns)
        return believed
