"""Whether a device's motion can be true: within what its robot can do, and without a jump."""

from __future__ import annotations

from fulmar_core.robots.robot import Limits
from fulmar_core.safety.input_gate import JUMP_M, InputGate, Measurement
from fulmar_core.states.state import RigidBodyState


def unbelievable(
    state: RigidBodyState,
    now_ns: int,
    last: tuple[RigidBodyState, int] | None,
    limits: Limits,
    *,
    turns_freely: bool = False,
) -> str:
    """Why no robot of these limits moves so; empty where one may.

    A place that stays where it has jumped to is believed again once the robot could have come there.

    Args:
        state: What was received.
        now_ns: When [ns].
        last: What was believed before, and when [ns].
        limits: Of the robot.
        turns_freely: Whether the robot turns about any axis, as in `InputGate`.
    """
    gate = InputGate(limits, frozen_after=0, jump_m=JUMP_M, turns_freely=turns_freely)
    if last is not None:
        gate.problem(Measurement(last[1], "odom", "base_link", last[0]))
    reason = gate.problem(Measurement(now_ns, "odom", "base_link", state)) or ""
    return reason.partition(": a new epoch")[0].replace("odom ", "its ")
