"""The plan of a standing system that a file of `configs/systems` describes."""

from __future__ import annotations

from dataclasses import replace

from fulmar_bringup.own_row import own_nodes
from fulmar_bringup.run_plan import RunPlan
from fulmar_bringup.system import NONE, load_system
from fulmar_core.wires.robot_name import checked_name


def system_plan(system: str, **choices: str | None) -> RunPlan:
    """The plan of a system file, incomplete, with other choices where they are given; rate and guards follow.

    Args:
        system: Name of a file in `configs/systems`.
        choices: Another robot, name of the robot, task, controller or backend; None: the file's.

    Raises:
        ConfigError: Unknown name, or a mistake in the file.
    """
    base = load_system(system)
    given = {key: value for key, value in choices.items() if value is not None}
    if "name" in given:
        checked_name(given["name"])
    chosen = replace(base, **given)  # type: ignore[arg-type]
    varied = replace(chosen, name=base.name) != base
    moved = chosen.backend == "hardware" != base.backend  # a real robot has the guards of its hardware
    return RunPlan(
        *(chosen.robot, chosen.task, chosen.controller, chosen.backend, 0.0 if varied else chosen.control_hz),
        name=chosen.name,
        guards=NONE if moved else chosen.guards,
        recording=chosen.recorder,
        nodes=own_nodes(chosen),
        standing=True,
    )
