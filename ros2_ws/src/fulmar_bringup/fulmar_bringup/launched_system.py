"""The rows that the launch file starts, from its arguments."""

from __future__ import annotations

import atexit
import shutil
import tempfile
from dataclasses import replace
from pathlib import Path

from fulmar_bringup.bag_origin import attachments, run_info
from fulmar_bringup.goal_plan import checked_goals, goal_path, goal_rate
from fulmar_bringup.node_spec import NodeSpec
from fulmar_bringup.node_table import OPTIONS
from fulmar_bringup.own_row import own_nodes
from fulmar_bringup.plan_checks import adapter_path, check_external
from fulmar_bringup.run_plan import RunPlan
from fulmar_bringup.system import default_hardware, varied_system
from fulmar_bringup.system_rows import system_rows
from fulmar_core.config.errors import ConfigError
from fulmar_core.config.written_text import check_lines
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks import load_task
from hardware_drivers.hardware import load_hardware
from hardware_drivers.own_driver import check_own_driver


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
    chosen = varied_system(
        system or "mujoco_policy",
        robot=robot,
        robot_name=name,
        task=task,
        controller=controller,
        backend=backend,
        hardware=hardware,
    )
    load_robot(chosen.robot).timing.substeps(chosen.control_hz)
    plan = RunPlan(
        chosen.robot,
        chosen.task,
        chosen.controller,
        chosen.backend,
        control_hz=chosen.control_hz,
        name=chosen.name,
        policy=policy or "",
        guards=chosen.guards,
        recording=chosen.recorder,
        nodes=own_nodes(chosen),
        extras=tuple(name for name in OPTIONS if switches.get(name) != "false"),
    )
    if plan.backend == "hardware":
        plan = replace(plan, hardware=default_hardware(plan.robot, hardware))
        check_own_driver(load_hardware(plan.hardware).driver)
    for word, given in (("emulate", emulate), *switches.items()):
        if given not in (None, "true", "false"):
            raise ConfigError(f"{word} = '{given}' must be true or false.")
    wires = None
    if emulate == "true":
        if plan.backend != "hardware":
            raise ConfigError(f"an emulator stands in for hardware, and the backend is {plan.backend}.")
        plan, wires = replace(plan, emulated=True), Path(tempfile.mkdtemp(prefix="fulmar_"))
        atexit.register(shutil.rmtree, wires, ignore_errors=True)  # with the launch itself
    check_external(plan.controller, plan.guards, adapter=adapter, topic=topic, lockstep=False)
    plan = replace(plan, adapter=adapter_path(plan.robot, adapter), adapter_topic=topic or "")
    if goals:
        checked_goals(goals, load_robot(plan.robot), load_task(plan.task), goal_rate(plan.control_hz))
        plan = replace(plan, goals=str(goal_path(goals)))
    record = {"info": run_info(plan), "files": attachments(plan)}
    return tuple(system_rows(plan, record=record, wires_folder=wires).values())
