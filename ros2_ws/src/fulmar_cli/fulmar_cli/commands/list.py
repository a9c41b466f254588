"""`fulmar list`: names of robots, tasks, controllers and other files."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any

import typer

from fulmar_bringup.console import log_line, output, print_json, write_line
from fulmar_cli.commands.arguments import JsonOption, argument
from fulmar_core.config.errors import FAILED, FulmarError, UnknownNameError
from fulmar_core.config.paths import config_names

FAMILIES = (
    "robots", "tasks", "controllers", "systems", "policies", "goals", "hardware", "scenarios", "estimators",
    "things",
)  # fmt: skip


def list_names(
    family: Annotated[
        str | None,
        argument(
            "[robots|tasks|controllers|systems|policies|goals|hardware|scenarios|estimators|things]",
            "All by default.",
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """List robots, tasks, controllers, policies, scenarios and other files by name.

    Your own come with them: FULMAR_CONFIGS names folders that have `robots/`, `tasks/` and so on.

    Exit code: 0 every file can be used, 1 some cannot; each of these has a line that says why.
    """
    if family is not None and family not in FAMILIES:
        raise UnknownNameError("family", family, FAMILIES)
    chosen = FAMILIES if family is None else (family,)
    found: dict[str, dict[str, str]] = {name: {} for name in chosen}
    errors = []
    for kind, entries in found.items():
        names, title_of = _family(kind)
        for name in names:
            try:
                entries[name] = title_of(name)
            except FulmarError as problem:
                errors.append({"family": kind, "name": name, "error": str(problem)})
    if as_json:
        names_of: dict[str, Any] = {name: list(entries) for name, entries in found.items()}
        print_json(names_of | ({"errors": errors} if errors else {}))
    else:
        _show(found)
    for error in errors:
        log_line(f"{error['family']}: {error['error']}")
    if errors:
        raise typer.Exit(FAILED)


def _show(found: dict[str, dict[str, str]]) -> None:
    for name, entries in found.items():
        output.print(f"{name}", style="bold")
        width = max((len(entry) for entry in entries), default=0)
        for entry, title in entries.items():
            write_line(f"  {entry:<{width}}  {title}".rstrip())


def _family(family: str) -> tuple[list[str], Callable[[str], str]]:
    """Names of one family, and what loads one of them and gives its title."""
    from fulmar_bringup.fleet_file import load_any_system
    from fulmar_core.estimators.kinds import load_estimator
    from fulmar_core.loop.policy_bundle import read_passport
    from fulmar_core.robots.robot_file import load_robot
    from fulmar_core.tasks import load_task
    from fulmar_core.tasks.goal_files import load_goal_file
    from fulmar_core.worlds.scenario import load_scenario
    from fulmar_core.worlds.structures import load_structure
    from hardware_drivers.hardware import load_hardware
    from policy_server.controllers import CONTROLLERS, policies_directory, shipped_policies

    if family == "policies":
        folder = policies_directory()
        return (
            [path.name for path in shipped_policies()],
            lambda name: f"{read_passport(folder / name).control_hz:g} Hz",
        )
    if family == "controllers":
        return list(CONTROLLERS), lambda name: CONTROLLERS[name].title
    loaders: dict[str, Callable[[str], Any]] = {
        "robots": load_robot,
        "tasks": load_task,
        "goals": load_goal_file,
        "hardware": load_hardware,
        "scenarios": load_scenario,
        "estimators": load_estimator,
        "systems": load_any_system,
        "things": load_structure,
    }
    load = loaders[family]
    return config_names(family), lambda name: str(load(name).title)
