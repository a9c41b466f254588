"""`fulmar service`: systems that begin when the computer does."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fulmar_bringup.console import log_line, output, print_json, write_line
from fulmar_cli.commands import arguments as cli
from fulmar_cli.commands.arguments import JsonOption, argument, flag, option

service = typer.Typer(
    help="Start a system at boot, by systemd. Nothing moves until a person resets the e-stop.",
    no_args_is_help=True,
    rich_markup_mode=None,
)
RootOption = Annotated[
    Path, option("DIR", "Folder that stands for /, such as the root of an image.", "--root")
]
NameArgument = Annotated[
    str | None, argument("[NAME]", "A service of `fulmar service status`; all by default.")
]
ROOT = Path("/")


@service.command()
def install(
    system: Annotated[str, argument("SYSTEM", "A name from `fulmar list systems`.")],
    robot: Annotated[str | None, option("R", "Another robot than the system's.")] = None,
    name: cli.NameOption = None,
    task: Annotated[str | None, option("T", "Another task.")] = None,
    controller: Annotated[str | None, option("C", "Another controller.")] = None,
    backend: Annotated[str | None, option("B", "mujoco, mock, jsbsim, basilisk or hardware.")] = None,
    hardware: cli.HardwareOption = None,
    policy: cli.PolicyOption = None,
    recording: Annotated[
        str, option("whole|ring|goals", "ring: only the time around faults, so that the disk fills slowly.")
    ] = "ring",
    user: Annotated[str | None, option("USER", "Who runs it; by default the person behind sudo.")] = None,
    root: RootOption = ROOT,
    dry_run: Annotated[bool, flag("--dry-run", "Print the files, and write nothing.")] = False,
    as_json: JsonOption = False,
) -> None:
    """Let systemd run `fulmar up SYSTEM --service` from boot on, as a user who is not root.

    After a boot or a restart nothing moves: the e-stop is pressed until a person resets it, goals from before do not
    count, and an autopilot is not armed, whatever the hardware file says. It restarts after a failure, at most twenty
    times in half an hour. Devices of the hardware file get rules of udev. Bags lie in /var/lib/fulmar/runs.

    Try:

    sudo .venv/bin/fulmar service install mujoco_lqr

    fulmar estop --reset && fulmar goals --robot floating_platform --pose 1,0,0

    journalctl -fu fulmar-mujoco_lqr
    """
    from fulmar_cli.installation.service_plan import Wanted, plan_service

    wanted = Wanted(system, robot, name, task, controller, backend, hardware, policy, recording, user)
    planned = plan_service(wanted, root, dry_run=dry_run)
    if dry_run:
        for path, text in planned.texts.items():
            output.print(f"# {path}\n{text}", markup=False, soft_wrap=True, highlight=False)
        return
    written, began = planned.write()
    if as_json:
        print_json(
            {"service": planned.files.name, "files": [str(path) for path in written], "started": began}
        )
        return
    for path in written:
        write_line(f"wrote {path}")
    if began:
        write_line(
            f"started {planned.files.unit.name}: the e-stop is pressed; `fulmar estop --reset` releases it"
        )
    else:
        write_line("systemd does not run here: the service begins with the next boot")


@service.command()
def status(name: NameArgument = None, root: RootOption = ROOT, as_json: JsonOption = False) -> None:
    """Show which services are installed, and whether they run; `fulmar status` shows what their nodes report."""
    from fulmar_bringup.service.installation import Files, find, installed, state_of

    chosen = [find(root, name)] if name else [Files(root, each) for each in installed(root)]
    states = [state_of(files) for files in chosen]
    if as_json:
        print_json({"services": states})
        return
    for state in states:
        boot = "at boot" if state["at_boot"] else "not at boot"
        write_line(f"{state['name']}: {state['active']}, {boot}: {state['command']}")
    if not states:
        log_line("no service is installed. `fulmar service install SYSTEM` installs one.")


@service.command()
def remove(
    name: Annotated[str, argument("NAME", "A service of `fulmar service status`.")],
    root: RootOption = ROOT,
    as_json: JsonOption = False,
) -> None:
    """Stop a service, and remove its unit and rules; its bags stay."""
    from fulmar_bringup.service.installation import find, remove_files, systemctl, systemd_runs

    files = find(root, name)
    runs = systemd_runs(root)
    if runs:
        systemctl("stop", files.unit.name)
    removed = remove_files(files)
    if runs:
        systemctl("daemon-reload")
    if as_json:
        print_json({"service": name, "removed": [str(path) for path in removed]})
        return
    for path in removed:
        write_line(f"removed {path}")
