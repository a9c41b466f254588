"""The document as tables in a terminal."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fulmar_benchmarks.rans3d.targets import (
    RANDOMISED,
    RANS_ATTITUDE_RAD,
    RANS_POSITION_M,
    RANS_STEPS,
    ROBOTS,
)
from fulmar_benchmarks.tables import NOTHING, Entry, Row, Shown, Table, display_name, number, tone_of

HEADS = (
    "success",
    "distance [m]",
    "attitude [°]",
    "velocity [m/s]",
    "turn rate [°/s]",
    "goals",
    "by RANS",
    "duty",
    "randomised",
    "of holdable",
)


def shown(document: Mapping[str, Any]) -> list[Shown]:
    """One table a robot, and the other parts line by line."""
    tables = [
        Table(
            display_name(robot),
            ("", "", *HEADS),
            [
                Row(
                    (Entry(display_name(task)), Entry(name), *cells_of(document, robot, task, name, cell)),
                    last=name == list(controllers)[-1],
                )
                for task, controllers in tasks.items()
                for name, cell in controllers.items()
            ],
            words=2,
        )
        for robot, tasks in robots_of(document).items()
    ]
    return [*tables, *missing(document), *notes(document), *other_lines(document)]


def robots_of(document: Mapping[str, Any]) -> dict[str, Any]:
    """Evaluated robots with their tasks."""
    every = {ROBOTS[0]: document["tasks"], ROBOTS[1]: document[ROBOTS[1]]}
    return {robot: tasks for robot, tasks in every.items() if tasks}


def _tone(document: Mapping[str, Any], robot: str, task: str, name: str, *, held: bool) -> str:
    """Whether a cell meets what is required of it."""
    for line in document["requirements"]:
        place = (line.get("robot"), line.get("task"), line.get("controller"), line.get("among_holdable"))
        if place == (robot, task, name, held):
            return tone_of(line["met"])
    return ""


def cells_of(
    document: Mapping[str, Any], robot: str, task: str, name: str, cell: dict[str, Any]
) -> list[Entry]:
    """The cells of one row, below `HEADS`."""
    disturbed = cell.get(RANDOMISED, {})
    held = disturbed.get("holdable", {})
    return [
        Entry(number(cell["success_rate"], 3), _tone(document, robot, task, name, held=False)),
        Entry(_spread(cell, "final_position_error_m", 3)),
        Entry(_spread(cell, "final_attitude_error_deg", 1)),
        Entry(_spread(cell, "velocity_error_m_s", 3)),
        Entry(_spread(cell, "rate_error_deg_s", 1)),
        Entry(
            number(cell["goals_reached"], 1)
            + (f" of {cell['goals_bound']:.1f}" if "goals_bound" in cell else "")
        ),
        Entry(number(cell["rans_success_rate"], 3)),
        Entry(number(cell["duty"], 2)),
        Entry(number(disturbed.get("success_rate"), 3)),
        Entry(number(held.get("success_rate"), 3), _tone(document, robot, task, name, held=True)),
    ]


def _spread(cell: dict[str, Any], figure: str, digits: int) -> str:
    """Median and 95th percentile."""
    found = cell["figures"].get(figure)
    if found is None or found["median"] is None:
        return NOTHING
    return f"{number(found['median'], digits)} ({number(found['p95'], digits)})"


def missing(document: Mapping[str, Any]) -> list[str]:
    """What could not be evaluated, and why."""
    return [
        f"{display_name(robot)}, {display_name(task)}, {name}: {cell['reason']}"
        for robot, tasks in robots_of(document).items()
        for task, controllers in tasks.items()
        for name, cell in controllers.items()
        if cell["reason"]
    ]


def notes(document: Mapping[str, Any]) -> list[str]:
    """What one has to know to read the tables."""
    if not robots_of(document):
        return []
    return [
        f"{document['episodes']:,} episodes in MuJoCo each, seed {document['seed']}. Errors are median (95th "
        "percentile), at the last step; those of velocities over the whole episode. By RANS: share of episodes within "
        f"{RANS_POSITION_M:g} m and {RANS_ATTITUDE_RAD:g} rad for {RANS_STEPS} steps in a row. Goals: mean, of the "
        "mean bound of the first episodes by time-optimal travel of a point mass, turning not counted. Duty: mean "
        "share of full command, of valves the share of time that they are open. Of holdable: success among the "
        "randomised episodes whose pose the linear programme can hold.",
        document["published_note"],
    ]


def other_lines(document: Mapping[str, Any]) -> list[str]:
    """Dead thrusters, integrator and pace, a line each."""
    lines = []
    for one in document["dead_thrusters"]:
        held = one.get("holdable", {})
        lines.append(
            f"{one['dead']} of {one['of']} thrusters dead, {one['task']}, {one['controller']}: success "
            f"{number(one['success_rate'], 3)} of {one['episodes']}, {number(held.get('success_rate'), 3)} of the "
            f"{held.get('episodes', 0)} that can be held"
        )
    if (found := document["integrator"]) is not None:
        lines.append(
            f"integrator ({found['method']}): order {found['order']:.2f}; torque-free tumble of "
            f"{found['moments_kg_m2']} kg·m² at {found['rate_rad_s']:g} rad/s for {found['seconds']:g} s, largest "
            "relative drifts:"
        )
        lines += [
            f"  {robot}, steps of {one['step_s']:g} s, {name}: energy {one[name]['energy']:.1e}, angular momentum "
            f"{one[name]['momentum']:.1e}, from Jacobi's closed form {one[name]['from_jacobi']:.1e}"
            for robot, one in found["robots"].items()
            for name in ("float64", "float32")
        ]
        other = found["mujoco"]
        lines += [
            f"  MuJoCo's {name}, steps of {other['step_s']:g} s for {other['seconds']:g} s: energy "
            f"{other[name]['energy']:.1e}, angular momentum {other[name]['momentum']:.1e}, from Jacobi's closed form "
            f"{other[name]['from_jacobi']:.1e}"
            for name in ("RK4", "Euler")
        ]
    if (found := document["throughput"]) is not None:
        for name in ("numpy", "compiled"):
            one = found[name]
            lines.append(
                f"batch, {name}: {found['reason']}"
                if one is None
                else f"batch of {found['worlds']:,} worlds, {name}: {_pace(one)}"
            )
    return lines


def _pace(one: dict[str, Any]) -> str:
    """Our steps a second, and MuJoCo's by both of its methods."""
    return (
        f"{one['batch_steps_per_s']:,.0f} steps/s; MuJoCo's rollout at steps of {one['mujoco_step_s']:g} s: with "
        f"{one['mujoco_integrator']} {one['mujoco_steps_per_s']:,.0f} ({one['ratio']:.1f} times slower), with Euler "
        f"{one['mujoco_euler_steps_per_s']:,.0f} ({one['ratio_with_euler']:.1f} times)"
    )


def conclusion(document: Mapping[str, Any]) -> str:
    """One sentence on what was required and met."""
    unmet = [line["name"] for line in document["requirements"] if line["met"] is False]
    return (
        f"{document['met']} of {document['asked']} requirements are met"
        + (f", {document['open']} could not be measured" if document["open"] else "")
        + (f"; not met: {'; '.join(unmet)}" if unmet else "")
        + "."
    )
