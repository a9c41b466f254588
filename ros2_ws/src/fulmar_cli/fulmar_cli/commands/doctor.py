"""`fulmar doctor`: is everything here that a run needs, and does it work?"""

from __future__ import annotations

from typing import Annotated

import typer

from fulmar_bringup.console import output, print_json
from fulmar_cli.commands.arguments import JsonOption
from fulmar_core.config.errors import DONE, FAILED, ConfigError, UnknownNameError


def doctor(
    name: Annotated[
        str | None,
        typer.Argument(metavar="[NAME]", help="With --for hardware: a hardware file; all by default."),
    ] = None,
    purpose: Annotated[
        str | None,
        typer.Option(
            "--for",
            metavar="hardware|sim",
            help="hardware: what a robot needs, and hardware files. sim: what a simulation needs. Both by default.",
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Check installation, network, processor, disk and devices; print the command that repairs what is wrong.

    Each check is ok, advice (it works, but worse than it could) or wrong. Exit code: 0, or 1 if something is wrong.

    With --for hardware also for each hardware file what stops the device when the driver dies; for a named one also
    whether its port is there.
    """
    from fulmar_cli.diagnosis.check_result import healthy
    from fulmar_cli.diagnosis.checks import PURPOSES, diagnose

    if purpose is not None and purpose not in PURPOSES:
        raise UnknownNameError("purpose of --for", purpose, PURPOSES)
    if name and purpose != "hardware":
        raise ConfigError(f"'{name}' names a hardware file: say `fulmar doctor --for hardware {name}`.")
    findings = diagnose(purpose, name)
    well = healthy(findings)
    if as_json:
        print_json({"healthy": well, "findings": [finding.as_dict() for finding in findings]})
    else:
        for finding in findings:
            line = f"{finding.level:<6} {finding.what}: {finding.found}"
            output.print(line, markup=False, soft_wrap=True)
            if finding.fix:
                output.print(f"       fix: {finding.fix}", markup=False, soft_wrap=True)
    raise typer.Exit(DONE if well else FAILED)
