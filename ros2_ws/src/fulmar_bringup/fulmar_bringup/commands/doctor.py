"""`fulmar doctor`: is everything here that a run needs, and does it work?"""

from __future__ import annotations

import typer

from fulmar_bringup.commands.arguments import JsonOption
from fulmar_bringup.console import output, print_json


def doctor(as_json: JsonOption = False) -> None:
    """Check the machine: Python, ROS, simulator, policies, timing, disk; say what to do about what is wrong."""
    from fulmar_bringup.diagnosis import diagnose

    findings = diagnose()
    if as_json:
        print_json({"healthy": all(f.ok for f in findings), "findings": [f.as_dict() for f in findings]})
    else:
        for finding in findings:
            output.print(f"{'ok  ' if finding.ok else 'BAD '} {finding.what}: {finding.found}", markup=False)
            if not finding.ok:
                output.print(f"       {finding.advice}", markup=False, soft_wrap=True)
    raise typer.Exit(0 if all(finding.ok for finding in findings) else 1)
