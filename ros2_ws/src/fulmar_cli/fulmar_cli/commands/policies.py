"""`fulmar policies`: make the policies that come with Fulmar."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from fulmar_bringup.console import log_line, print_json, write_line
from fulmar_cli.commands.arguments import JsonOption, RayOption, argument, flag, invoked_command, option
from fulmar_cli.installation.extras import require
from fulmar_core.config.errors import FAILED, ConfigError, did_you_mean


def policies(
    names: Annotated[
        list[str] | None, argument("[NAME]...", "Bundles such as kingfisher_go_to_pose; all.")
    ] = None,
    out: Annotated[Path | None, option("DIR", "Folder of the bundles; the shipped ones by default.")] = None,
    runs: Annotated[Path, option("DIR", "Folder of the run folders.")] = Path("runs/policies"),
    anew: Annotated[bool, flag("--anew", "Make all anew; what exists is moved beside its run.")] = False,
    ray: RayOption = None,
    as_json: JsonOption = False,
) -> None:
    """Make the shipped policies of configs/policies.yaml: train, evaluate in MuJoCo, export.

    A bundle that was made from the same robot, task, scenario, settings, seed and updates is left as it is; an
    interrupted run is resumed. So the command can be repeated until everything exists. The same seed and updates make
    the same weights on the same kind of processor.

    Try:

    fulmar policies

    fulmar policies kingfisher_go_to_pose --anew
    """
    from fulmar_core.config.provenance import git_revision
    from policy_server.controllers import policies_directory
    from training.policies import expected_s, is_made, load_policy_table, make_policies, policy_job, set_aside
    from training.progress import JobBars
    from training.ray_executor import executor_at

    if ray:
        require("ray")
    table = load_policy_table()
    known = [policy.name for policy in table.policies]
    for name in names or []:
        if name not in known:
            raise ConfigError(f"configs/policies.yaml has no policy '{name}'.{did_you_mean(name, known)}")
    jobs = [
        policy_job(
            policy,
            episodes=table.episodes,
            runs=runs,
            bundles=out or policies_directory(),
            command=invoked_command(),
            git_revision=git_revision(),
        )
        for policy in table.policies
        if not names or policy.name in names
    ]
    missing = jobs if anew else [job for job in jobs if not is_made(job)]
    minutes = expected_s(missing, table.at_once) / 60.0
    for job in jobs if anew else []:
        if aside := set_aside(job):
            log_line(f"{job.name}: the old one is in {aside}")
    log_line(f"{len(missing)} of {len(jobs)} policies to make, about {minutes:.0f} min and the evaluation")
    with JobBars([job.name for job in missing]) as bars:
        lines = make_policies(table, jobs, executor_at(ray, table.at_once), bars)
    if as_json:
        print_json({"policies": lines})
    else:
        _print_lines(lines)
    if not all(line["good"] for line in lines):
        raise typer.Exit(FAILED)


def _print_lines(lines: list[dict[str, Any]]) -> None:
    width = max(len(line["policy"]) for line in lines)
    write_line(f"{'policy':<{width}}  success  needed")
    for line in lines:
        success = "   -   " if line["success"] is None else f"{line['success']:7.3f}"
        note = "" if line["good"] else f"  {line.get('error', 'too low')}"
        write_line(f"{line['policy']:<{width}}  {success}  {line['needed']:6.2f}{note}")
