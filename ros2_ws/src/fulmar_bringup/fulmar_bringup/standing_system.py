"""A system that runs until it is stopped: goals, swaps and e-stops come from outside, and are reported as events."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from fulmar_bringup.console import log_line
from fulmar_bringup.node_keeper import NodeKeeper
from fulmar_bringup.node_spec import CONTROLLER, PARTS, PLANT
from fulmar_bringup.node_table import OPTIONS
from fulmar_bringup.own_row import own_nodes
from fulmar_bringup.planning import RunRequest, chosen_recording, plan_run
from fulmar_bringup.processes import ProcessGroup
from fulmar_bringup.readiness import raise_if_ended, wait_for_publisher, wait_for_reader, while_starting
from fulmar_bringup.remote_parts import RemoteController, domain_text
from fulmar_bringup.run_executor import (
    LAST_WORDS_S,
    STOPPED,
    passed_s,
    raise_if_silent,
    run_nodes,
    silence_limits_s,
    with_plant_reaction,
)
from fulmar_bringup.run_plan import RunPlan
from fulmar_bringup.supervisor import Report, Supervisor
from fulmar_bringup.system import System
from fulmar_bringup.system_events import Emit, SystemEvents, distance_of, mode_of
from fulmar_core.config.errors import ConfigError, RunFailed, UnknownNameError
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import SIMULATION_START_NS
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal import PoseTuple
from policy_server.controllers import controller_entry

Show = Callable[[float, float | None, str], None]  # time [s], distance from the goal [m], mode


def plan_system(
    system: System,
    *,
    record: Path,
    command: str,
    policy: Path | None = None,
    hardware: str | None = None,
    emulate: bool = False,
    arm: bool = False,
    scenario: str = "nominal",
    seed: int = 0,
    start: PoseTuple | None = None,
    rate: float = 1.0,
    recording: str | None = None,
    extras: Sequence[str] = tuple(OPTIONS),
    unattended: bool = False,
    only: str | None = None,
) -> RunRequest:
    """Plan a system that has no end.

    Args:
        system: What to run.
        record: Folder of the bag, or of all bags; must not exist.
        command: Command line, for the record.
        policy: Bundle; the shipped one by default.
        hardware: Hardware file; the robot's own by default.
        emulate: Whether an emulator stands in for the device.
        arm: Whether an autopilot may be armed that the hardware file does not arm.
        scenario: Name of the scenario.
        seed: Seed.
        start: Where a simulated robot begins; the origin by default.
        rate: Simulated seconds a wall-clock second.
        recording: A mode of `fulmar_core.config.recording` instead of the system's own.
        extras: Optional nodes of the table that run.
        unattended: Whether a service starts it: an e-stop node begins pressed, and nothing is armed.
        only: plant or controller, where the other one runs in another place.

    Raises:
        ConfigError: As of `plan_run`; a bag for each goal, where goals stream; or a controller alone, where the
            system has an external one.
    """
    guards = replace(system.guards, estop=True) if unattended else system.guards
    if only is not None and only not in PARTS:
        raise UnknownNameError("part of --only", only, PARTS)
    if only == CONTROLLER and controller_entry(system.controller).is_external:
        raise ConfigError(
            "the controller of this system is external, and you start it. Use --only plant or another --controller."
        )
    if only == CONTROLLER and recording is not None:
        raise ConfigError("the recorder runs beside the plant: --recording goes with --only plant.")
    request = plan_run(
        robot=system.robot,
        name=system.name or None,
        task=system.task,
        controller=system.controller,
        backend=system.backend,
        policy=policy,
        goal=None,
        start=start or (0.0,) * load_robot(system.robot).state_type.AXES,
        duration_s=None,
        lockstep=False,
        rate=rate,
        control_hz=system.control_hz,
        scenario=scenario,
        seed=seed,
        record=record,
        command=command,
        hardware=hardware,
        emulate=emulate,
        arm=arm,
        guards={name: value for name, value in asdict(guards).items() if value},
        goals_later=True,
        extras=extras,
    )
    if unattended and arm:
        raise ConfigError(
            "--service and --arm exclude one another: a person arms, beside the robot, by `fulmar up --arm`."
        )
    kept = chosen_recording(system.recorder, recording)
    if kept.mode == "goals" and load_task(system.task).goal_topic == "goal_velocity":
        raise ConfigError(
            f"velocities stream: task '{system.task}' gets no bag for each goal. Use --recording whole or ring."
        )
    plan = replace(
        request.plan,
        duration_s=0.0,
        unattended=unattended,
        recording=kept,
        nodes=own_nodes(system),
        only=only or "",
    )
    return replace(request, plan=plan)


@dataclass(frozen=True)
class Ending:
    """How a system ended."""

    failure: str  # why it failed; empty where it was stopped
    watchdog_trips: int | None  # of the plant; None where it has not reported any number


def keep_up(request: RunRequest, emit: Emit, show: Show) -> Ending:
    """Run a system, or its plant alone, until Ctrl-C, SIGTERM or the end of one of its nodes.

    Args:
        request: Of `plan_system`.
        emit: Called with each event; see `SystemEvents`. The first is `started`.
        show: Called several times a second with time, distance and mode.

    Returns:
        How it ended.

    Raises:
        ConfigError: As of `execute`.
        DeviceError: The device is not there.
    """
    stopped, plant_report = "", Report()

    def watch(
        request: RunRequest, plan: RunPlan, overseer: Supervisor, group: ProcessGroup, keeper: NodeKeeper
    ) -> str:
        nonlocal stopped, plant_report
        plant_report = overseer.plant
        try:
            _get_ready(request, plan, overseer, group)
            emit("started", **described(plan), name=plan.robot_name, bag=str(request.record))
            _follow(plan, overseer, keeper, SystemEvents(emit), show)
        except RunFailed as error:
            time.sleep(LAST_WORDS_S)
            return with_plant_reaction(str(error), overseer)
        except KeyboardInterrupt as stop:
            stopped = str(stop) or STOPPED
            emit("stopping", reason=stopped)
            raise
        return ""

    def restarted(node: str, reason: str) -> None:
        emit("restarted", time_s=round(passed_s(request.plan, plant_report), 3), node=node, reason=reason)

    failure = run_nodes(request, watch, restarted).failure
    asked = re.fullmatch(rf"{STOPPED}|stopped by SIG[A-Z]+", failure)  # also while the nodes still start
    return Ending("" if asked else failure, trips_of(plant_report))


def report_newest(plan: RunPlan, overseer: Supervisor, events: SystemEvents, show: Show) -> None:
    """Turn the newest reports of plant and controller into events, and show where the robot stands."""
    plant, controller = overseer.plant, overseer.controller
    time_s = round(passed_s(plan, plant), 3)
    events.look(plant, controller, time_s)
    show(time_s, distance_of(controller.values), mode_of(plant, controller))


def trips_of(plant: Report) -> int | None:
    """Watchdog trips that a plant has reported; None where it has not reported any number."""
    trips = plant.values.get("watchdog_trips")
    return int(trips) if trips else None


def described(plan: RunPlan) -> dict[str, Any]:
    """Fields of the event `started`."""
    return {name: getattr(plan, name) for name in ("robot", "task", "controller", "backend", "control_hz")}


def _get_ready(request: RunRequest, plan: RunPlan, overseer: Supervisor, group: ProcessGroup) -> None:
    """Wait for the controller, publish the obstacles, and start the plant.

    A plant alone starts at once, and begins when its controller has come.
    """
    external = controller_entry(plan.controller).is_external
    if plan.only == PLANT:
        if not plan.hardware or plan.emulated:
            now_ns = time.time_ns() if plan.hardware else SIMULATION_START_NS
            overseer.publish_obstacles(request.mission, now_ns)
        overseer.start_plant(while_starting(group, overseer), lambda: group.last_words("plant"))
        log_line(f"the plant of '{plan.robot_name}' waits for its controller, in {domain_text()}")
        return
    if external:
        wait_for_publisher(plan, overseer, lambda: raise_if_ended(group))
    starting = while_starting(group, overseer)
    if not external:
        overseer.wait_until(lambda: overseer.controller.values.get("mode") == "armed", starting)
        now_ns = time.time_ns() if plan.hardware else SIMULATION_START_NS
        if not plan.hardware or plan.emulated:
            overseer.give_obstacles(request.mission, time_ns=now_ns, alive=starting)
    overseer.start_plant(starting, lambda: group.last_words("plant"))
    if external:
        wait_for_reader(plan, overseer, lambda: raise_if_ended(group))


def _follow(
    plan: RunPlan, overseer: Supervisor, keeper: NodeKeeper, events: SystemEvents, show: Show
) -> None:
    """Report what happens, until a node ends or falls silent without which the robot must end.

    Raises:
        RunFailed: One did.
    """
    plant_limit_s, controller_limit_s = silence_limits_s(plan)
    plant, controller = overseer.plant, overseer.controller
    remote = RemoteController(plan, controller, silent_s=controller_limit_s) if plan.only == PLANT else None

    def report() -> bool:
        if remote is not None:
            remote.look(events)
        report_newest(plan, overseer, events, show)
        return False

    def running() -> None:
        keeper.look()
        if remote is None:
            raise_if_silent("controller", overseer.silent_s(controller), controller_limit_s)
        raise_if_silent("plant", overseer.silent_s(plant), plant_limit_s)

    overseer.wait_until(report, running)
