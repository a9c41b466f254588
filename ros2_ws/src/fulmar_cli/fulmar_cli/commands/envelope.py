"""The check of a run's robot against the certified set of its bundle."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from fulmar_bringup.console import warn
from fulmar_cli.commands.arguments import flag

if TYPE_CHECKING:
    from fulmar_bringup.run_plan import RunPlan

RequireEnvelopeOption = Annotated[
    bool, flag("--require-envelope", "Refuse a bundle unless this robot lies inside its certified set.")
]


def warn_outside(plan: RunPlan, *, required: bool) -> None:
    """Warn where a plan's robot lies outside of the certified set of its bundle, or of what its guard believes.

    Raises:
        BundleError: It does, or there is no set, and that is required; or it answers later than the set holds.
    """
    guard = plan.guards.guard
    if not (plan.policy or required or guard):
        return
    from fulmar_bringup.envelope_check import envelope_note, guard_note
    from fulmar_core.robots.robot_file import load_robot

    robot = load_robot(plan.robot)
    notes = (envelope_note(plan.policy, robot, plan.task, required=required), guard_note(robot, guard))
    if any(notes):
        warn([note for note in notes if note])
