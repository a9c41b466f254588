"""Arbiter: whether a controller may act now; one pure function, most severe reason first."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

BEARING_OFF = "the air bearing is off"
BEYOND_GEOFENCE = "beyond the geofence"  # a part of the reason by which a goal that came is not followed


class Mode(Enum):
    """Stages of a controller, in the order in which it goes through them."""

    UNCONFIGURED = "unconfigured"  # nothing loaded
    IDLE = "idle"  # loaded, validated, warm
    ARMED = "armed"  # running, safe command only
    ACTIVE = "active"  # the controller's own command
    FAULT = "fault"  # safe command until the node is configured anew


@dataclass(slots=True)
class Flags:
    """Everything that the decision depends on, besides the time. Its owner changes it in place."""

    configured: bool = False
    activated: bool = False
    latched_fault: str = ""  # reason, empty if there is none
    has_goal: bool = False
    last_input_ns: int | None = None  # steady clock at the newest accepted measurement
    input_problem: str = ""  # why the newest measurement was refused, empty if it was not
    input_timeout_ns: int = 0
    goal_distance: float = 0.0  # [m]
    geofence: float = float("inf")  # [m]
    lacking: str = "goal"  # what there is none of yet, where `has_goal` is false
    rests: bool = False  # an emergency stop held it, and no goal came since: nothing may move it
    estop: str = ""  # why the emergency stop holds, empty if it does not
    outside: str = ""  # how the robot left the area that it may be in, empty if it did not
    contested: str = ""  # which nodes publish one of the inputs, where more than one does
    unconverged: str = ""  # why the robot came no nearer to its goal, empty if it does
    image_problem: str = ""  # why the controller cannot see what it acts on, empty if it can or need not
    bearing_off: bool = False  # the robot has an air bearing that is not known to be on
    active_s: float = 0.0  # how long it has been acting [s]
    max_run_time_s: float = 0.0  # and how long it may; 0: for ever [s]


@dataclass(frozen=True, slots=True)
class Decision:
    """The mode, whether the controller's command may go out, and why not.

    Attributes:
        may_brake: Whether, where it may not, the guard of keep-out volumes may: the robot's place is known, and nothing
            stops its actuators.
    """

    mode: Mode
    may_act: bool
    reason: str
    may_brake: bool = False


def arbitrate(flags: Flags, now_ns: int) -> Decision:
    """Decide for one instant of the steady clock [ns]; anything but ACTIVE means the safe command, or a guard's."""
    if flags.latched_fault:
        return Decision(Mode.FAULT, False, flags.latched_fault)
    if not flags.configured:
        return Decision(Mode.UNCONFIGURED, False, "not configured")
    if not flags.activated:
        return Decision(Mode.IDLE, False, "not activated")
    if flags.estop:
        return Decision(Mode.ARMED, False, flags.estop)
    if 0.0 < flags.max_run_time_s < flags.active_s:
        return Decision(Mode.ARMED, False, f"max_run_time of {flags.max_run_time_s:g} s is over")
    if flags.contested:
        return Decision(Mode.ARMED, False, flags.contested)
    if flags.last_input_ns is None:
        return Decision(Mode.ARMED, False, flags.input_problem or "no odom yet. Is the plant running?")
    age_ns = now_ns - flags.last_input_ns
    if age_ns > flags.input_timeout_ns:
        cause = f" ({flags.input_problem})" if flags.input_problem else ""
        limit = flags.input_timeout_ns / 1e6
        return Decision(
            Mode.ARMED, False, f"no usable odom for {age_ns / 1e6:.0f} ms (limit {limit:.0f} ms){cause}"
        )
    if flags.input_problem:
        return Decision(Mode.ARMED, False, flags.input_problem)
    if flags.image_problem:
        return Decision(Mode.ARMED, False, flags.image_problem, may_brake=not flags.rests)
    if flags.outside:
        return Decision(Mode.ARMED, False, flags.outside, may_brake=not flags.rests)
    if flags.bearing_off:
        return Decision(Mode.ARMED, False, BEARING_OFF)
    if flags.unconverged:
        return Decision(Mode.ARMED, False, flags.unconverged, may_brake=True)
    if not flags.has_goal:
        return Decision(Mode.ARMED, False, f"no {flags.lacking} yet", may_brake=not flags.rests)
    if not flags.goal_distance <= flags.geofence:  # so that a distance that is not a number is beyond it too
        return Decision(
            Mode.ARMED,
            False,
            f"goal is {flags.goal_distance:.1f} m away, {BEYOND_GEOFENCE} of {flags.geofence:g} m",
            may_brake=True,
        )
    return Decision(Mode.ACTIVE, True, "")


def asks_for_a_goal(reason: str) -> bool:
    """Whether a reason not to act means that a goal, obstacles or the place of a thing is missing, or a nearer goal."""
    return reason.endswith(" yet") or BEYOND_GEOFENCE in reason
