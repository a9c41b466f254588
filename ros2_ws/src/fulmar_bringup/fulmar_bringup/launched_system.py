"""The rows that the launch file starts, from its arguments."""

from __future__ import annotations

import atexit
import shutil
import tempfile
from dataclasses import replace
from pathlib import Path

from fulmar_bringup.bag_origin import attachments, run_info
from fulmar_bringup.completion import completed
from fulmar_bringup.fleet_file import is_fleet
from fulmar_bringup.fleet_plan import FleetChoices, fleet_plan, fleet_rows
from fulmar_bringup.node_spec import NodeSpec
from fulmar_bringup.node_table import OPTIONS, USUALLY_ON
from fulmar_bringup.plan_checks import checked
from fulmar_bringup.run_plan import RunPlan
from fulmar_bringup.system_plan import USUAL, system_plan
from fulmar_bringup.system_rows import system_rows
from fulmar_core.config.errors import ConfigError
from fulmar_core.config.written_text import check_lines

ARGUMENTS = {
    "system": f"a file of configs/systems, without .yaml; {USUAL} by default, or what the robot usually does",
    "robot": "a file of configs/robots, without .yaml",
    "name": "what the robot is called: its namespace; its type by default",
    "task": "a file of configs/tasks, without .yaml, or your own class: mypackage.mymodule:MyTask",
    "controller": "policy, a classical one such as lqr, mymodule:MyController, or external: a node of yours",
    "backend": "mujoco, mock, jsbsim, basilisk or hardware",
    "hardware": "a file of configs/hardware, without .yaml, or a path to one",
    "policy": "folder of a policy bundle",
    "adapter": "with controller external, a file of configs/hardware: commands come in as its driver sends them",
    "topic": "topic that the adapter takes, in the place of the file's",
    "emulate": "true: with backend hardware, an emulator stands in for the device",
    "goals": "a file of configs/goals, without .yaml, that a node of its own publishes",
    **{
        name: f"{'false: not this' if name in USUALLY_ON else 'true'}. {text}"
        for name, text in OPTIONS.items()
    },
}


def list_nodes(**asked: str | None) -> tuple[NodeSpec, ...]:
    """Nodes of a system, each of its choices replaced by what is given.

    Args:
        asked: Texts by the names of `ARGUMENTS`; None: not given.

    Returns:
        As in `system_rows`. The row of an external controller is not there, or is that of its adapter.

    Raises:
        ConfigError: Unknown name, or a mistake in a file.
    """
    check_lines(asked.items())
    for word in ("emulate", *OPTIONS):
        if asked.get(word) not in (None, "true", "false"):
            raise ConfigError(f"{word} = '{asked[word]}' must be true or false.")
    system = asked.get("system")
    if system is not None and is_fleet(system):
        return _fleet_nodes(system, asked)
    choices = {name: asked.get(name) for name in ("robot", "name", "task", "controller", "backend")}
    plan = replace(
        system_plan(asked.get("system"), **choices),
        policy=asked.get("policy") or "",
        goals=asked.get("goals") or "",
        hardware=asked.get("hardware") or "",
        adapter=asked.get("adapter") or "",
        adapter_topic=asked.get("topic") or "",
        emulated=asked.get("emulate") == "true",
    )
    plan = replace(plan, extras=tuple(name for name in OPTIONS if _runs(asked.get(name), name, plan)))
    plan, wires = checked(completed(plan)), None
    if plan.emulated:
        wires = Path(tempfile.mkdtemp(prefix="fulmar_"))
        atexit.register(shutil.rmtree, wires, ignore_errors=True)  # with the launch itself
    record = {"info": run_info(plan), "files": attachments(plan)}
    return tuple(system_rows(plan, record=record, wires_folder=wires).values())


def _fleet_nodes(system: str, asked: dict[str, str | None]) -> tuple[NodeSpec, ...]:
    """Nodes of a fleet, whose file says everything for each robot."""
    for name, value in asked.items():
        if value is not None and name != "system":
            raise ConfigError(f"{name}:={value}: the file of the fleet '{system}' says it for each robot.")
    shared, robots = fleet_rows(fleet_plan(system, FleetChoices(standing=True, launched=True)))
    return (*shared, *(spec for rows in robots.values() for spec in rows))


def _runs(asked: str | None, name: str, plan: RunPlan) -> bool:
    """Whether a node with an option runs: as is said, else as its system file has it or as is usual."""
    return asked == "true" if asked is not None else name in (*USUALLY_ON, *plan.extras)
