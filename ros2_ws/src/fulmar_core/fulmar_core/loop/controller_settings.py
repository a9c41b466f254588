"""ROS parameters of a controller node, and what follows from them."""

from __future__ import annotations

import math
from dataclasses import dataclass

from fulmar_core.loop.formation import ShapePlace
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.sensors.repetition import FROZEN_AFTER, is_noisy
from fulmar_core.safety.arbiter import Flags
from fulmar_core.safety.geofence import NO_AREA, check_area
from fulmar_core.safety.input_gate import JUMP_M, InputGate
from fulmar_core.safety.keep_apart import Other
from fulmar_core.states.spatial import SpatialState
from fulmar_core.wires.silence import default_timeout

MOST_COPIES = 3
ENVELOPE = "envelope"  # the guard that stops a body that floats within its bounds
GUARDS = ("", ENVELOPE)
POLICY = "policy"  # the controller that runs a bundle, which another one may follow while the node runs
# Of a plant whose states of the actuators may come late or get lost, before nothing is learned
MISSED_TICKS = 5
FROZEN_STEPS = 5  # repeats of one measurement in lock step, one a control step, that no noisy sensor gives


@dataclass(frozen=True)
class ControllerSettings:
    """ROS parameters of a controller node."""

    controller: str = POLICY  # a name of `fulmar list controllers`
    robot: str = "floating_platform"
    task: str = "go_to_pose"
    thing: str = ""  # in space, in the place of that of the task; empty: as the task has it
    policy: str = ""  # folder of the bundle, for policies
    control_hz: float = 0.0  # 0: the robot's own [Hz]
    lockstep: bool = False
    rate: float = 1.0  # simulated seconds a wall-clock second, where not in lock step
    input_timeout_s: float = 0.0  # 0: two control periods, at least 0.2 s and at most 0.5 s [s]
    wait_for_subscribers: int = 0  # of actuators/command, before the first answer in lock step
    goals_streamed: bool = False  # a goal node sends the goal with each odometry; lock step waits for it
    fallback: str = ""  # classical controller that takes over when a policy is refused, or its commands are
    excitation: str = ""  # goal file of torques, for `excite` on satellites; empty: our own profile
    seed: int = 0  # of the noise of a controller that draws any
    trusted_keys: str = ""  # file or folder of public keys: no bundle runs that none of them has signed
    estop: bool = False  # nothing moves before an e-stop message is received
    unattended: bool = (
        False  # begun by a service: goals that were published before the reset of the e-stop do not count
    )
    max_run_time_s: float = 0.0  # of acting, in the robot's own time; 0: for ever [s]
    # x_min, x_max, y_min, y_max that the robot must not leave, in space also z_min, z_max [m].
    area: tuple[float, ...] = NO_AREA
    guard: str = ""  # `envelope`: a backup law takes over before the robot leaves its bounds
    overruns_to_stop: int = 25  # beats in a row, each late by a whole period, before it is a fault; 0: never
    odometry_may_repeat: bool = False  # to the last bit, while the robot stands: that of encoders does
    air_bearing: bool = False  # wait for `air_bearing/state`, as with a bearing in the robot's YAML
    copies: int = 1  # of each command, within its period; in real time only
    fleet: bool = False  # listen to the e-stop of a fleet, too
    # Robots of the fleet that the guard keeps apart from this one, each as `NAME TYPE`, or `NAME TYPE guarded`
    neighbours: tuple[str, ...] = ("",)
    formation: str = (
        ""  # place in a formation: `LEADER X Y HEADING` [m, m, deg], of which LEADER is a neighbour
    )
    autostart: bool = True

    def __post_init__(self) -> None:
        for name in ("control_hz", "rate", "input_timeout_s", "max_run_time_s"):
            if not 0.0 <= getattr(self, name) < math.inf:
                raise ValueError(f"{name} = {getattr(self, name)} must be a finite number, at least 0.")
        if self.rate == 0.0:
            raise ValueError(f"rate = {self.rate:g} must be greater than 0.")
        for name in ("overruns_to_stop", "seed"):
            if getattr(self, name) < 0:
                raise ValueError(f"{name} = {getattr(self, name)} must not be negative.")
        if not 1 <= self.copies <= MOST_COPIES:
            raise ValueError(f"copies = {self.copies} must be from 1 to {MOST_COPIES}.")
        if self.guard not in GUARDS:
            raise ValueError(f"guard = '{self.guard}' must be '{ENVELOPE}' or empty.")
        if self.area != NO_AREA:
            check_area(self.area)
        _ = self.others, self.place  # an entry that is none is refused now
        if self.place is not None and self.place.leader not in [other.name for other in self.others]:
            raise ValueError(f"formation = '{self.formation}' follows a robot that is not in 'neighbours'.")

    @property
    def others(self) -> tuple[Other, ...]:
        """Robots of the fleet that a guard keeps apart from this one."""
        return tuple(Other.of(text) for text in self.neighbours if text)

    @property
    def place(self) -> ShapePlace | None:
        """Place in a formation, whose leader is one of `others`; None without one."""
        return ShapePlace.of(self.formation) if self.formation else None

    def control_rate(self, robot: Robot) -> float:
        """Command rate in the robot's own time [Hz]."""
        return self.control_hz or robot.timing.control_hz

    def pause_ns(self, robot: Robot) -> int:
        """After so long without a command the actuators are in their safe state, and memories are of no use [ns]."""
        hz = self.control_rate(robot)
        pause_s = 1.75 / hz if self.lockstep else default_timeout(1.0 / hz) * max(self.rate, 1.0)
        return round(1e9 * pause_s)

    def flags(self, robot: Robot) -> Flags:
        """What the arbiter knows before anything has happened."""
        timeout_s = self.input_timeout_s or default_timeout(1.0 / self.control_rate(robot)) / min(
            self.rate, 1.0
        )
        return Flags(
            input_timeout_ns=round(timeout_s * 1e9),
            geofence=robot.limits.geofence,
            max_run_time_s=self.max_run_time_s,
            bearing_off=self.has_bearing(robot),
        )

    def has_bearing(self, robot: Robot) -> bool:
        """Whether nothing may move before an air bearing is on."""
        return self.air_bearing or robot.air_bearing

    def hold_ns(self, robot: Robot) -> int:
        """How long a state of the actuators may stand for what came after it, before messages must be missing [ns]."""
        longest_s = (
            1.75 / self.control_rate(robot) if self.lockstep else MISSED_TICKS * robot.timing.physics_dt
        )
        return round(1e9 * longest_s)

    def input_gate(self, robot: Robot) -> InputGate:
        """What lets measurements in; in lock step episodes begin anywhere."""
        odometry = robot.sensors.odometry
        repeats = self.odometry_may_repeat or not is_noisy(odometry.position, odometry.heading)
        frozen_after = FROZEN_STEPS if self.lockstep else FROZEN_AFTER
        return InputGate(
            robot.limits,
            frozen_after=0 if repeats else frozen_after,
            jump_m=math.inf if self.lockstep else JUMP_M,
            turns_freely=robot.state_type is SpatialState,
            turns_only=robot.actuators.turns_only,
            odometry=None if robot.actuators.turns_only else odometry,
        )
