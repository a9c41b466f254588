"""A system that runs until it is stopped: goals, swaps and e-stops come from outside, and are reported as events."""

from __future__ import annotations

import re
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from fulmar_bringup.console import log_line
from fulmar_bringup.node_keeper import NodeKeeper
from fulmar_bringup.node_spec import PLANT
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
from fulmar_bringup.system_events import Emit, SystemEvents, distance_of, mode_of
from fulmar_core.config.errors import RunFailed
from fulmar_core.robots.topics import SIMULATION_START_NS
from policy_server.controllers import controller_entry

Show = Callable[[float, float | None, str], None]  # time [s], distance from the goal [m], mode


@dataclass(frozen=True)
class Ending:
    """How a system ended."""

    failure: str  # why it failed; empty where it was stopped
    watchdog_trips: int | None  # of the plant; None where it has not reported any number


def keep_up(plan: RunPlan, emit: Emit, show: Show) -> Ending:
    """Run a system, or its plant alone, until Ctrl-C, SIGTERM or the end of one of its nodes.

    Args:
        plan: Of a standing system.
        emit: Called with each event; see `SystemEvents`. The first is `started`.
        show: Called several times a second with time, distance and mode.

    Returns:
        How it ended.

    Raises:
        ConfigError: As in `execute`.
        DeviceError: The device is not there.
    """
    stopped, plant_report = "", Report()

    def watch(plan: RunPlan, overseer: Supervisor, group: ProcessGroup, keeper: NodeKeeper) -> str:
        nonlocal stopped, plant_report
        plant_report = overseer.plant
        try:
            _get_ready(plan, overseer, group)
            emit("started", **described(plan), name=plan.robot_name, bag=plan.record)
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
        emit("restarted", time_s=round(passed_s(plan, plant_report), 3), node=node, reason=reason)

    failure = run_nodes(plan, watch, restarted).failure
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


def _get_ready(plan: RunPlan, overseer: Supervisor, group: ProcessGroup) -> None:
    """Wait for the controller, publish the obstacles, and start the plant.

    A plant alone starts at once, and begins when its controller has come.
    """
    external = controller_entry(plan.controller).is_external
    assert plan.mission is not None  # as in `completed`
    if plan.only == PLANT:
        if not plan.is_real:
            now_ns = time.time_ns() if plan.hardware else SIMULATION_START_NS
            overseer.publish_obstacles(plan.mission, now_ns)
        overseer.start_plant(while_starting(group, overseer), lambda: group.last_words("plant"))
        log_line(f"the plant of '{plan.robot_name}' waits for its controller, in {domain_text()}")
        return
    if external:
        wait_for_publisher(plan, overseer, lambda: raise_if_ended(group))
    starting = while_starting(group, overseer)
    if not external:
        overseer.wait_until(lambda: overseer.controller.values.get("mode") == "armed", starting)
        now_ns = time.time_ns() if plan.hardware else SIMULATION_START_NS
        if not plan.is_real:
            overseer.give_obstacles(plan.mission, time_ns=now_ns, alive=starting)
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
