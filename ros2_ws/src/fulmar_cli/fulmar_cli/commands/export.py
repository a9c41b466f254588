"""`fulmar export`: make a policy bundle from a training run."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from fulmar_bringup.console import output
from fulmar_cli.commands.arguments import argument, flag, option
from fulmar_core.errors import ConfigError


def export(
    run: Annotated[Path, argument("RUN", "Run folder that `fulmar train` left.")],
    out: Annotated[Path, option("DIR", "Folder of the bundle; new or empty.")],
    force: Annotated[bool, flag("--force", "Replace the bundle that DIR holds.")] = False,
) -> None:
    """Write a policy bundle: network, golden vectors and passport; then load it as the robot will."""
    if out.exists() and not force and (not out.is_dir() or any(out.iterdir())):
        raise ConfigError(
            f"{out} exists already and is not empty; no bundle is overwritten. Give --out another folder, or --force."
        )
    from fulmar_core.robot import load_robot
    from fulmar_core.tasks import load_task
    from policy_server.policy import Policy
    from training.export import export as write

    passport = write(run, out)
    Policy(out, load_robot(passport.robot), load_task(passport.task), control_hz=passport.control_hz)
    output.print(
        f"{out}: {passport.robot} · {passport.task} · {passport.control_hz:g} Hz · {passport.sha256[:12]}"
    )
