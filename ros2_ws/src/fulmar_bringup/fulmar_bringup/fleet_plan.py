"""The plan of a fleet: a plan for each robot, and the processes of all."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from fulmar_bringup.bag_origin import attachments, run_info
from fulmar_bringup.completion import completed
from fulmar_bringup.fleet_file import FORMATION, Fleet, FleetRow, check_starts_apart, drawn, load_fleet
from fulmar_bringup.node_spec import CONTROLLER, PLANT, NodeSpec, Parameter, node_spec
from fulmar_bringup.node_table import USUALLY_ON
from fulmar_bringup.plan_checks import checked
from fulmar_bringup.processes import command_line
from fulmar_bringup.run_plan import RunPlan
from fulmar_bringup.system_rows import system_rows
from fulmar_core.config.errors import ConfigError
from fulmar_core.config.provenance import fulmar_version, git_revision
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import CLOCK, FLEET_STATUS
from fulmar_core.safety.keep_apart import check_can_brake
from fulmar_core.wires.robot_name import FLEET, namespace_of

RECORDER = "recorder"


@dataclass(frozen=True)
class FleetPlan:
    """What a fleet is started with.

    Attributes:
        name: Of the file.
        fleet: The file.
        robots: A complete plan of each robot, in the order of the file.
        seed: Of everything that is drawn.
        record: Folder of the one bag, or of a bag of each robot.
        command: Command line, for the record.
        record_each: Whether each robot has a recorder and a bag of its own, below `record` by its name.
    """

    name: str
    fleet: Fleet
    robots: tuple[RunPlan, ...]
    seed: int
    record: str
    command: str = ""
    record_each: bool = False

    def robot_in_bag(self, one: RunPlan) -> str | None:
        """Name by which the bag at `one.record` knows a robot; None where the bag is the robot's own."""
        return None if self.record_each else one.robot_name

    @property
    def lockstep(self) -> bool:
        """Whether every plant waits for its controller, and the world for every plant."""
        return self.robots[0].lockstep

    @property
    def duration_s(self) -> float:
        """Length of the run; 0: until it is stopped [s]."""
        return self.robots[0].duration_s


@dataclass(frozen=True)
class FleetChoices:
    """What a command asks for, beside the file."""

    seed: int = 0
    lockstep: bool = False
    rate: float = 1.0
    duration_s: float | None = None  # None: as long as the robot needs that needs longest [s]
    record: Path | str | None = None
    estop: bool = False  # an e-stop node for each robot
    keep_apart: bool = True  # False: no guard acts, whatever the file says
    record_each: bool = False  # a bag for each robot in the place of the one of all
    command: str = ""
    standing: bool = False
    launched: bool = False  # by the launch file: nothing supervises the nodes


def fleet_plan(name: str, choices: FleetChoices) -> FleetPlan:
    """The complete, checked plan of a fleet's file.

    Raises:
        ConfigError: As in `load_fleet` and `planned`.
    """
    return planned(name, load_fleet(name), choices)


def planned(name: str, fleet: Fleet, choices: FleetChoices) -> FleetPlan:
    """The complete, checked plan of a fleet.

    Args:
        name: Of its file.
        fleet: As the file has it, or changed.
        choices: What a command asks for.

    Raises:
        ConfigError: As in `completed` and `checked`; starts that touch; robots of several rates in lock step; a guard
            of a robot that cannot brake.
    """
    if not choices.keep_apart and fleet.task == FORMATION:
        raise ConfigError(
            f"fleet '{name}' is a formation, whose robots keep apart. Leave --no-keep-apart out."
        )
    if not choices.keep_apart:
        fleet = replace(fleet, robots=tuple(replace(row, keep_apart=False) for row in fleet.robots))
    places = drawn(fleet, choices.seed)
    plans = [
        completed(_asked(fleet, row, choices, *places.get(row.called, ((), ())))) for row in fleet.robots
    ]
    if not choices.standing:
        longest = choices.duration_s or max(plan.duration_s for plan in plans)
        plans = [replace(plan, duration_s=longest) for plan in plans]
    check_starts_apart({plan.robot_name: (plan.robot, plan.start) for plan in plans}, f"fleet '{name}'")
    for row in fleet.robots:
        if row.keep_apart:
            check_can_brake(load_robot(row.robot))
    rates = {plan.control_hz: plan.robot_name for plan in plans}
    if choices.lockstep and len(rates) > 1:
        text = " and ".join(f"'{robot}' at {hz:g} Hz" for hz, robot in rates.items())
        raise ConfigError(f"in lock step a fleet has one period, and there are {text}. Give one control_hz.")
    return FleetPlan(
        name,
        fleet,
        tuple(checked(plan) for plan in plans),
        choices.seed,
        str(choices.record or ""),
        choices.command,
        choices.record_each,
    )


def _asked(
    fleet: Fleet, row: FleetRow, choices: FleetChoices, start: tuple[float, ...], goal: tuple[float, ...]
) -> RunPlan:
    """The plan of one robot as its row has it."""
    guards = replace(row.guards, estop=row.guards.estop or choices.estop)
    standing = choices.standing
    return RunPlan(
        *(row.robot, row.task, row.controller, row.backend, row.control_hz or fleet.control_hz),
        name=row.called,
        policy=row.policy,
        scenario=row.scenario,
        seed=choices.seed,
        start=start or row.start or (0.0, 0.0, 0.0),
        # A robot of a formation has no goal of its own but its place.
        goal=goal if row.place else None if standing else (goal or row.goal or None),
        goals="" if standing else row.goals,
        guards=guards,
        lockstep=choices.lockstep,
        rate=choices.rate,
        standing=standing,
        extras=USUALLY_ON if standing else (),
        record=str(Path(choices.record or "") / row.called)
        if choices.record_each
        else str(choices.record or ""),
        command=choices.command,
        recording=fleet.recorder,
        supervised=not choices.launched,
    )


def fleet_rows(plan: FleetPlan) -> tuple[list[NodeSpec], dict[str, list[NodeSpec]]]:
    """Processes of a fleet: those that all share, and those of each robot by its name, in the order of their start."""
    rows = {one.robot_name: system_rows(one, record=_recorded(plan, one)) for one in plan.robots}
    plants = {one.robot_name: _plant(plan, one, rows[one.robot_name][PLANT]) for one in plan.robots}
    space = namespace_of(FLEET)
    words: dict[str, Parameter] = {
        "plants": json.dumps({name: command_line(spec)[3:] for name, spec in plants.items()}),
        "lockstep": plan.lockstep,
        "rate": plan.robots[0].rate,
        "autostart": not plan.robots[0].supervised,
    }
    world = node_spec(space, FLEET, "sim_nodes.fleet_node", words, outputs=(CLOCK.name, FLEET_STATUS.name))
    of_all = [] if plan.record_each else [_recorder(plan, [of_robot[RECORDER] for of_robot in rows.values()])]
    shared = [*of_all, world]
    return shared, {
        one.robot_name: [
            _controller(plan, one, spec) if spec.name == CONTROLLER else spec
            for spec in rows[one.robot_name].values()
            if spec.name != PLANT and (plan.record_each or spec.name != RECORDER)
        ]
        for one in plan.robots
    }


def _recorded(plan: FleetPlan, one: RunPlan) -> dict[str, str]:
    """Arguments of a robot's own recorder; empty ones where one recorder of all takes its place."""
    if not plan.record_each:
        return {"directory": "", "info": "", "files": ""}
    shared = {"fleet": plan.name, "least_distance": plan.fleet.least_distance}
    info = json.dumps(shared | robot_info(plan, one))
    return {"directory": one.record, "info": info, "files": attachments(one)}


def _row_of(plan: FleetPlan, robot: RunPlan) -> FleetRow:
    return next(row for row in plan.fleet.robots if row.called == robot.robot_name)


def _plant(plan: FleetPlan, robot: RunPlan, spec: NodeSpec) -> NodeSpec:
    more: dict[str, Parameter] = {
        "autostart": False,  # the node of all starts them, once each is there
        "clock": False,
        "fleet": True,
        "neighbours": _row_of(plan, robot).keep_apart,
    }
    return replace(spec, parameters=spec.parameters | more)


def _controller(plan: FleetPlan, robot: RunPlan, spec: NodeSpec) -> NodeSpec:
    more: dict[str, Parameter] = {"fleet": True}
    others = neighbours_of(plan, robot)
    more |= {"neighbours": others} if others else {}
    place = formation_of(plan, robot)
    more |= {"formation": place} if place else {}
    return replace(spec, parameters=spec.parameters | more)


def neighbours_of(plan: FleetPlan, robot: RunPlan) -> list[str]:
    """The robots that a guard keeps apart from a robot, as the controller's parameter has them; empty without one."""
    if not _row_of(plan, robot).keep_apart:
        return []
    others = (row for row in plan.fleet.robots if row.called != robot.robot_name)
    return [f"{row.called} {row.robot}{' guarded' if row.keep_apart else ''}" for row in others]


def formation_of(plan: FleetPlan, robot: RunPlan) -> str:
    """Place of a robot in a formation, as the controller's parameter has it; empty without one."""
    place = _row_of(plan, robot).place
    return " ".join([plan.fleet.robots[0].called, *(f"{number:g}" for number in place)]) if place else ""


def _recorder(plan: FleetPlan, specs: Sequence[NodeSpec]) -> NodeSpec:
    """One recorder for all: what each robot's would be given, together."""
    things: list[str] = []
    own: list[str] = []
    for spec in specs:
        for name, found in (("things", things), ("own_topics", own)):
            value = spec.parameters.get(name, [])
            found += [str(word) for word in (value if isinstance(value, list) else []) if word not in found]
    parameters = {
        key: value
        for key, value in specs[0].parameters.items()
        if key not in ("things", "own_topics", "directory", "run_info", "attachments")
    }
    parameters |= {
        "robots": [one.robot_name for one in plan.robots],
        "directory": plan.record,
        "run_info": fleet_info(plan),
        "attachments": fleet_attachments(plan),
    }
    parameters |= {"lossless": True} if any(spec.parameters.get("lossless") for spec in specs) else {}
    parameters |= ({"things": things} if things else {}) | ({"own_topics": own} if own else {})
    return replace(specs[0], namespace=namespace_of(FLEET), parameters=parameters)


def robot_info(plan: FleetPlan, one: RunPlan) -> dict[str, Any]:
    """The run record of one robot of a fleet."""
    own: dict[str, Any] = json.loads(run_info(one))
    return own | {"neighbours": neighbours_of(plan, one), "formation": formation_of(plan, one)}


def fleet_info(plan: FleetPlan) -> str:
    """The run record of a fleet's bag, as JSON: that of each robot by its name, and what all share."""
    return json.dumps(
        {
            "fleet": plan.name,
            "title": plan.fleet.title,
            "seed": plan.seed,
            "lockstep": plan.lockstep,
            "rate": plan.robots[0].rate,
            "least_distance": plan.fleet.least_distance,
            "command": plan.command,
            "robots": {one.robot_name: robot_info(plan, one) for one in plan.robots},
            "fulmar_version": fulmar_version(),
            "git_revision": git_revision(),
        }
    )


def fleet_attachments(plan: FleetPlan) -> str:
    """Attachments of a fleet's bag: those of each robot, below its name."""
    every = {
        f"{one.robot_name}/{name}": what
        for one in plan.robots
        for name, what in json.loads(attachments(one)).items()
    }
    return json.dumps(every)
