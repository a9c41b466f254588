"""The rows of a system: every node of a plan, in the order of its start, and the subscribers that each waits for.

`fulmar run`, `fulmar up`, the launch file, `evaluate --through ros`, the fault suite, re-runs through a node and the
benchmarks start these rows, or some of them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path

from fulmar_bringup.emulation import Emulation, emulation_of
from fulmar_bringup.lockstep_chain import chain_of, paced_wire
from fulmar_bringup.node_row import Launcher
from fulmar_bringup.node_spec import NodeSpec
from fulmar_bringup.node_table import node_rows
from fulmar_bringup.run_plan import RunPlan
from fulmar_core.config.errors import ConfigError, did_you_mean
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import (
    ANSWER,
    CAMERA_IMAGES,
    CAMERA_INFO,
    CLOCK,
    EVENTS,
    EVENTS_2,
    ODOMETRY,
    PERIOD,
    RATE,
    WIRES,
    command_wire,
)
from fulmar_core.tasks import load_task
from hardware_drivers.hardware import load_hardware
from policy_server.controllers import controller_entry

STREAMS = tuple(wire.name for wire in (EVENTS, EVENTS_2, RATE, *CAMERA_IMAGES, CAMERA_INFO))


def system_rows(
    plan: RunPlan,
    *,
    record: Mapping[str, str] | None = None,
    wires_folder: Path | None = None,
    emulation: Emulation | None = None,
    port: str = "",
) -> dict[str, NodeSpec]:
    """Every row of a plan.

    Args:
        plan: What to run.
        record: Of the recorder: arguments of `recorder_spec`; None: nothing is recorded.
        wires_folder: Where the wires of an emulated device that are files are made.
        emulation: Emulated device, in the place of the one that the hardware file describes.
        port: Where a device is, in the place of what the hardware file says.

    Returns:
        Rows by name, in the order of their start; those of one part, where the plan has only that.

    Raises:
        ConfigError: Two rows have one name, or a row has an input that nothing publishes.
    """
    if plan.emulated and emulation is None:
        assert wires_folder is not None
        emulation = emulation_of(load_hardware(plan.hardware), wires_folder)
    launcher = Launcher(record, emulation, port)
    found = [(row.part, spec) for row in node_rows() for spec in row.specs(plan, launcher)]
    specs = [spec for _, spec in found]
    _check_chain(plan)
    check_rows(specs, outside=_from_outside(plan))
    there = {spec.name for part, spec in found if plan.only in ("", part)}
    return {spec.name: _passed_on(spec, plan) for spec in _with_listeners(specs, plan) if spec.name in there}


def _passed_on(row: NodeSpec, plan: RunPlan) -> NodeSpec:
    """The row with its intercepted outputs under their other names, of which one process is the only subscriber."""
    names = {topic: other for node, topic, other in plan.intercepted if node == row.name}
    if not names:
        return row
    waits = {"wait_for_subscribers": 1} if "wait_for_subscribers" in row.parameters else {}
    return replace(row, remappings={**row.remappings, **names}, parameters={**row.parameters, **waits})


def check_rows(rows: Iterable[NodeSpec], *, outside: Iterable[str] = ()) -> None:
    """Refuse rows that cannot work together.

    Args:
        rows: All that run.
        outside: Topics that come from elsewhere, beside those of operators and devices.

    Raises:
        ConfigError: Two have one name or publish the clock or the odometry, or one has an input that nothing publishes.
    """
    rows = list(rows)
    names = [row.name for row in rows]
    for name in names:
        if names.count(name) > 1:
            modules = " and ".join(row.module for row in rows if row.name == name)
            raise ConfigError(f"two nodes are called '{name}': {modules}. Give one of them another name.")
    for topic, why in ((CLOCK.name, "a system has one clock"), (ODOMETRY.name, "a controller follows one")):
        sources = [row.name for row in rows if topic in row.outputs]
        if len(sources) > 1:
            raise ConfigError(f"{' and '.join(sources)} publish {topic}, and {why}. Leave one out.")
    published = {topic for row in rows for topic in row.outputs}
    published |= set(outside) | {wire.name for wire in WIRES if wire.source == "operator"}
    for row in rows:
        for topic in row.inputs:
            if topic not in published:
                raise ConfigError(
                    f"node '{row.name}' receives '{topic}', which nothing in the system publishes."
                    f"{did_you_mean(topic, sorted(published))}"
                )


def _check_chain(plan: RunPlan) -> None:
    """Refuse nodes of a system's own that would hold up lock step for ever."""
    for node in plan.nodes if plan.lockstep else ():
        if PERIOD.name in node.inputs and ANSWER.name not in node.outputs:
            raise ConfigError(
                f"node '{node.name}' receives '{PERIOD.name}', and its outputs lack '{ANSWER.name}': in lock step the "
                "plant waits for its answer. See docs/estimation.md."
            )
        if ODOMETRY.name in node.outputs and PERIOD.name not in node.inputs:
            raise ConfigError(
                f"node '{node.name}' publishes '{ODOMETRY.name}': in lock step it answers each period of the plant. "
                f"Add '{PERIOD.name}' to its inputs and '{ANSWER.name}' to its outputs (docs/estimation.md)."
            )


def _from_outside(plan: RunPlan) -> set[str]:
    """Topics of nodes that Fulmar does not start, and those on which nothing comes by the clock."""
    found = set() if plan.lockstep else {PERIOD.name}
    if controller_entry(plan.controller).is_external:
        found.add(command_wire(load_robot(plan.robot)).name)
    if plan.hardware:  # motion capture, or another node that knows where the robot is
        found |= {"odom", "mocap/pose"}
    if plan.hardware and not plan.emulated:  # an emulator sees no things
        found |= {thing.wire.name for thing in load_task(plan.task, plan.thing).things}
    return found


def _with_listeners(rows: list[NodeSpec], plan: RunPlan) -> list[NodeSpec]:
    """The same rows, where plant and controller wait until all their subscribers are matched."""
    command, paced = command_wire(load_robot(plan.robot)).name, paced_wire(plan).name
    # An external controller answers odometry in lock step; by the clock, only its owner knows where it measures.
    answers = plan.lockstep and controller_entry(plan.controller).is_external
    chained = bool(chain_of(plan))
    awaited = {
        "plant": _listeners(rows, paced) + (answers and not chained),
        "controller": _listeners(rows, command),
    }
    if chained:
        awaited["estimator"] = _listeners(rows, ODOMETRY.name) + answers
        # Every output of these has the same listeners: the recorder, and the one node that takes them.
        awaited |= {
            row.name: min(_listeners(rows, topic) for topic in _streams(row)) for row in rows if _streams(row)
        }
    return [
        replace(row, parameters={**row.parameters, "wait_for_subscribers": awaited[row.name]})
        if row.name in awaited
        else row
        for row in rows
    ]


def _streams(row: NodeSpec) -> tuple[str, ...]:
    """Outputs of a camera or a rate estimator, whose loss would hold up lock step; of any other row none."""
    return tuple(topic for topic in row.outputs if topic in STREAMS)


def _listeners(rows: Iterable[NodeSpec], topic: str) -> int:
    return sum(topic in (*row.inputs, *row.observed) for row in rows if not row.optional)
