"""How a goal of an action client ends other than by arrival: error codes of Nav2, and words. Knows no ROS.

Codes are those of Nav2 1.3: those from 100 on of `FollowPath`, those from 200 on of `ComputePathToPose`, which Nav2's
navigator passes on in its own results.
"""

from __future__ import annotations

from collections.abc import Container, Mapping
from dataclasses import dataclass

from fulmar_core.safety.arbiter import BEYOND_GEOFENCE, Mode
from fulmar_core.safety.estop import HOLDS
from fulmar_core.safety.geofence import OUT_OF_BOUNDS

NONE = 0
UNKNOWN, INVALID_CONTROLLER, TF_ERROR, INVALID_PATH = 100, 101, 102, 103
FAILED_TO_MAKE_PROGRESS, NO_VALID_CONTROL, CONTROLLER_TIMED_OUT = 105, 106, 107
GOAL_OUTSIDE_MAP = 204
STATUS_SILENT_S = 2.0  # of a controller that reports twice a second [s]
ODOMETRY_SILENT_S = 1.0
HELD_S = 5.0  # a controller may wait so long for odometry, for its air bearing or for a part that is started anew [s]
TAKEN_WITHIN_S = 3.0  # after which a goal that the controller has not taken is not coming through [s]


@dataclass(frozen=True)
class ActionEnd:
    """Why a goal was aborted."""

    code: int
    words: str


def end_of(
    status: Mapping[str, str], stamps: Container[int], *, since_s: float, taken: bool, held_s: float = 0.0
) -> ActionEnd | None:
    """What the status of a controller means for a goal; None while it goes on.

    Args:
        status: Values of `controller/status`.
        stamps: Of all messages of the goal [ns].
        since_s: Time since the first of them was published [s].
        taken: Whether the controller has followed one of them.
        held_s: How long the controller has not acted, for whatever reason [s].
    """
    reason, refused = status.get("reason", ""), status.get("goal_refused", "")
    if status.get("mode") == Mode.FAULT.value:
        return ActionEnd(NO_VALID_CONTROL, f"the controller has a fault: {reason}")
    if reason.startswith(HOLDS):
        return ActionEnd(NO_VALID_CONTROL, reason)
    if refused and stamp_of(status, "goal_refused_stamp_ns") in stamps:
        beyond = refused.startswith(OUT_OF_BOUNDS) or BEYOND_GEOFENCE in refused
        return ActionEnd(GOAL_OUTSIDE_MAP if beyond else NO_VALID_CONTROL, refused)
    given_ns = stamp_of(status, "goal_stamp_ns")
    if given_ns in stamps:
        if status.get("unconverged"):
            return ActionEnd(FAILED_TO_MAKE_PROGRESS, status["unconverged"])
        held = held_s > HELD_S
        return ActionEnd(NO_VALID_CONTROL, f"the controller does not act: {reason}") if held else None
    if not taken and since_s <= TAKEN_WITHIN_S:
        return None
    if not given_ns:
        return ActionEnd(NO_VALID_CONTROL, "the controller has not taken the goal, or has dropped it")
    by = status.get("goal_by") or "another node"
    return ActionEnd(UNKNOWN, f"the controller follows a goal of {by} instead")


def stamp_of(status: Mapping[str, str], key: str) -> int:
    """A stamp in a status; 0 where there is none [ns]."""
    text = status.get(key, "")
    return int(text) if text.isdecimal() else 0
