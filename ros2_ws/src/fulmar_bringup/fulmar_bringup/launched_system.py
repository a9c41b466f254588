"""The rows that the launch file starts, from its arguments."""

from __future__ import annotations

import atexit
import shutil
import tempfile
from dataclasses import replace
from pathlib import Path

from fulmar_bringup.bag_origin import attachments, run_info
from fulmar_bringup.completion import completed
from fulmar_bringup.node_spec import NodeSpec
from fulmar_bringup.node_table import OPTIONS
from fulmar_bringup.plan_checks import checked
from fulmar_bringup.system_plan import system_plan
from fulmar_bringup.system_rows import system_rows
from fulmar_core.config.errors import ConfigError
from fulmar_core.config.written_text import check_lines


def list_nodes(
    *,
    system: str | None = None,
    robot: str | None = None,
    name: str | None = None,
    task: str | None = None,
    controller: str | None = None,
    backend: str | None = None,
    policy: str | None = None,
    goals: str | None = None,
    hardware: str | None = None,
    adapter: str | None = None,
    topic: str | None = None,
    emulate: str | None = None,
    **switches: str | None,
) -> tuple[NodeSpec, ...]:
    """Nodes of a system, each of its choices replaced by what is given.

    Args:
        system: Name of a file in `configs/systems`; `mujoco_policy` by default.
        robot: Another robot.
        name: Another name of the robot; that of the system or its type by default.
        task: Another task.
        controller: Another controller.
        backend: Another backend.
        policy: Folder of a bundle; the shipped one by default.
        goals: Name of a file in `configs/goals`, or a path that ends in `.yaml`; without it goals come from outside.
        hardware: Name of a file in `configs/hardware`, or a path that ends in `.yaml`; the robot's own by default.
        adapter: With controller `external`, name or path of the hardware file whose commands it speaks.
        topic: Topic that the adapter takes them from; the file's by default.
        emulate: `true`: with backend hardware, an emulator stands in for the device.
        switches: `false`, by the name of an optional node of the table: it does not run.

    Returns:
        As of `system_rows`. The row of an external controller is not there, or is that of its adapter.

    Raises:
        ConfigError: Unknown name, or a mistake in a file.
    """
    given_texts = {
        "system": system, "robot": robot, "name": name, "task": task, "controller": controller, "backend": backend,
        "policy": policy, "goals": goals, "hardware": hardware, "adapter": adapter, "topic": topic,
        "emulate": emulate, **switches,
    }  # fmt: skip
    check_lines(given_texts.items())
    for word, given in (("emulate", emulate), *switches.items()):
        if given not in (None, "true", "false"):
            raise ConfigError(f"{word} = '{given}' must be true or false.")
    chosen = system_plan(
        system or "mujoco_policy", robot=robot, name=name, task=task, controller=controller, backend=backend
    )
    plan = replace(
        chosen,
        policy=policy or "",
        goals=goals or "",
        hardware=hardware or "",
        adapter=adapter or "",
        adapter_topic=topic or "",
        emulated=emulate == "true",
        extras=tuple(name for name in OPTIONS if switches.get(name) != "false"),
    )
    plan, wires = checked(completed(plan)), None
    if plan.emulated:
        wires = Path(tempfile.mkdtemp(prefix="fulmar_"))
        atexit.register(shutil.rmtree, wires, ignore_errors=True)  # with the launch itself
    record = {"info": run_info(plan), "files": attachments(plan)}
    return tuple(system_rows(plan, record=record, wires_folder=wires).values())
