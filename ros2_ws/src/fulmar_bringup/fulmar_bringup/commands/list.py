"""`fulmar list`: what there is."""

from __future__ import annotations

from typing import Annotated

import typer

from fulmar_bringup.commands.arguments import JsonOption
from fulmar_bringup.console import output, print_json
from fulmar_core.errors import UnknownNameError
from fulmar_core.paths import config_names

FAMILIES = (
    "robots", "tasks", "controllers", "systems", "policies", "goals", "hardware", "scenarios", "estimators",
)  # fmt: skip


def list_names(
    family: Annotated[
        str | None,
        typer.Argument(
            metavar="[robots|tasks|controllers|systems|policies|goals|hardware|scenarios|estimators]",
            help="All by default.",
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Show the robots, tasks, controllers, policies, scenarios and files of other kinds there are.

    Your own come with them: FULMAR_CONFIGS names folders that have `robots/`, `tasks/` and so on.
    """
    if family is not None and family not in FAMILIES:
        raise UnknownNameError("family", family, FAMILIES)
    chosen = FAMILIES if family is None else (family,)
    found = {name: _entries(name) for name in chosen}
    if as_json:
        print_json({name: list(entries) for name, entries in found.items()})
        return
    for name, entries in found.items():
        output.print(f"{name}", style="bold")
        width = max((len(entry) for entry in entries), default=0)
        for entry, title in entries.items():
            output.print(f"  {entry:<{width}}  {title}".rstrip(), markup=False, soft_wrap=True)


def _entries(family: str) -> dict[str, str]:
    """Names and titles of one family."""
    from fulmar_bringup.system import CONTROLLERS, load_system
    from fulmar_core.disturbances.scenario import load_scenario
    from fulmar_core.estimation.settings import load_estimator
    from fulmar_core.goal_files import load_goals
    from fulmar_core.policy_bundle import read_passport
    from fulmar_core.robot import load_robot
    from fulmar_core.tasks import load_task
    from hardware_drivers.settings import load_hardware
    from policy_server.shipped import shipped_policies

    if family == "robots":
        return {name: load_robot(name).title for name in config_names("robots")}
    if family == "tasks":
        return {name: load_task(name).title for name in config_names("tasks")}
    if family == "goals":
        return {name: load_goals(name).title for name in config_names("goals")}
    if family == "hardware":
        return {name: load_hardware(name).title for name in config_names("hardware")}
    if family == "scenarios":
        return {name: load_scenario(name).title for name in config_names("scenarios")}
    if family == "estimators":
        return {name: load_estimator(name).title for name in config_names("estimators")}
    if family == "systems":
        return {name: load_system(name).title for name in config_names("systems")}
    if family == "policies":
        return {path.name: f"{read_passport(path).control_hz:g} Hz" for path in shipped_policies()}
    return {name: entry.title for name, entry in CONTROLLERS.items()}
