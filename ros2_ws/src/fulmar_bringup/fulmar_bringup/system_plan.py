"""The plan of a standing system that a file of `configs/systems` describes."""

from __future__ import annotations

from dataclasses import replace

from fulmar_bringup.camera_row import CAMERA
from fulmar_bringup.own_row import own_nodes
from fulmar_bringup.run_plan import RunPlan
from fulmar_bringup.system import NONE, System, load_system
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.wires.robot_name import checked_name

USUAL = "mujoco_policy"  # where neither a system nor a robot is asked for


def system_plan(system: str | None, **choices: str | None) -> RunPlan:
    """The plan of a system file, incomplete, with other choices where they are given; rate and guards follow.

    A robot without a system does what it usually does, in MuJoCo; what takes goals, does so.

    Args:
        system: Name of a file in `configs/systems`; None: none is asked for.
        choices: Another robot, name of the robot, task, controller or backend; None: the file's.

    Raises:
        ConfigError: Unknown name, or a mistake in the file.
    """
    base = load_system(system or USUAL)
    if not system and choices.get("robot"):
        base = _usual(base, str(choices["robot"]))
    given = {key: value for key, value in choices.items() if value is not None}
    if "name" in given:
        checked_name(given["name"])
    chosen = replace(base, **given)  # type: ignore[arg-type]
    varied = not chosen.controller or replace(chosen, name=base.name) != base
    moved = chosen.backend == "hardware" != base.backend  # a real robot has the guards of its hardware
    return RunPlan(
        *(chosen.robot, chosen.task, chosen.controller, chosen.backend, 0.0 if varied else chosen.control_hz),
        name=chosen.name,
        guards=NONE if moved else chosen.guards,
        recording=chosen.recorder,
        nodes=own_nodes(chosen),
        extras=(CAMERA,) if chosen.camera else (),
        origin=chosen.origin,
        standing=True,
    )


def _usual(base: System, robot: str) -> System:
    """A system of a robot whose task, controller and rate are completed; goals come to it from outside."""
    kind = load_robot(robot).kind
    return replace(base, robot=robot, task=kind.goal_task if kind.stays else "", controller="")
