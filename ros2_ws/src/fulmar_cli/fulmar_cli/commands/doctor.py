"""`fulmar doctor`: is everything here that a run needs, and does it work?"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from fulmar_bringup.console import output, print_json
from fulmar_cli.commands.arguments import JsonOption
from fulmar_core.errors import ConfigError, UnknownNameError

if TYPE_CHECKING:
    from fulmar_cli.diagnosis import Finding


def doctor(
    name: Annotated[
        str | None,
        typer.Argument(metavar="[NAME]", help="With --for hardware: a hardware file; all by default."),
    ] = None,
    what: Annotated[
        str | None,
        typer.Option("--for", metavar="hardware", help="Check hardware files instead of the machine."),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Check the machine: Python, ROS, simulator, policies, timing, disk; say what to do about what is wrong.

    With --for hardware: for each hardware file, what stops the device when the driver dies; for a named one also
    whether its port is there.
    """
    from fulmar_cli.diagnosis import diagnose, diagnose_hardware

    if what not in (None, "hardware"):
        raise UnknownNameError("subject of --for", str(what), ["hardware"])
    if name and not what:
        raise ConfigError(f"'{name}' names a hardware file: say `fulmar doctor --for hardware {name}`.")
    findings = diagnose_hardware(name) if what else diagnose()
    if as_json:
        print_json({"healthy": all(f.ok for f in findings), "findings": [f.as_dict() for f in findings]})
    else:
        for finding in findings:
            output.print(f"{mark(finding)} {finding.what}: {finding.found}", markup=False, soft_wrap=True)
            if not finding.ok:
                output.print(f"       {finding.advice}", markup=False, soft_wrap=True)
    raise typer.Exit(0 if all(finding.ok for finding in findings) else 1)


def mark(finding: Finding) -> str:
    """How the line of a finding begins."""
    if not finding.ok:
        return "BAD "
    return "WARN" if finding.warning else "ok  "
