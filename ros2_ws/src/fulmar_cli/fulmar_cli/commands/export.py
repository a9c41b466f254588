"""`fulmar export`: make a policy bundle from a training run, or a model for JSBSim from an aircraft."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from fulmar_bringup.console import write_line
from fulmar_cli.commands.arguments import argument, flag, option
from fulmar_core.config.errors import ConfigError, UnknownNameError

JSBSIM = "jsbsim"


def export(
    run: Annotated[
        Path, argument("RUN", "Run folder that `fulmar train` left; with --to jsbsim an aircraft.")
    ],
    out: Annotated[Path, option("DIR", "Folder of the bundle or model; new or empty.")],
    to: Annotated[
        str | None, option("FORMAT", "jsbsim: write an aircraft's model for JSBSim in place of a bundle.")
    ] = None,
    robot: Annotated[
        str | None,
        option("NAME", "Another robot, for a network that asks for a wrench; its own by default."),
    ] = None,
    force: Annotated[bool, flag("--force", "Replace the bundle that DIR holds.")] = False,
) -> None:
    """Write a policy bundle: network, golden vectors and passport; then load it as the robot will.

    `--to jsbsim` takes the name of an aircraft and writes a root folder of JSBSim's: `aircraft/NAME`, `engine`, a
    script that trims and flies it, and the planet it was compared on.
    """
    if out.exists() and not force and (not out.is_dir() or any(out.iterdir())):
        raise ConfigError(
            f"{out} exists already and is not empty; no bundle is overwritten. Give --out another folder, or --force."
        )
    from fulmar_core.robots.robot_file import load_robot

    if to is not None:
        if to != JSBSIM:
            raise UnknownNameError("format", to, (JSBSIM,))
        from sim_nodes.jsbsim_root import write_root

        craft = load_robot(str(run))
        write_line(
            f"{write_root(craft, out)}: for JSBSim. Trim it and fly it: JSBSim --root={out} "
            f"--script=scripts/{craft.name}.xml"
        )
        return
    from fulmar_core.tasks import load_task
    from policy_server.policy import Policy
    from training.export import export as write

    passport = write(run, out, robot)
    Policy(out, load_robot(passport.robot), load_task(passport.task), control_hz=passport.control_hz)
    write_line(
        f"{out}: {passport.robot} · {passport.task} · {passport.control_hz:g} Hz · {passport.sha256[:12]}"
    )
