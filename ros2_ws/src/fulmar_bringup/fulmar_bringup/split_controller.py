"""The controller of a system whose plant runs in another place: it waits for its plant, and survives its restart."""

from __future__ import annotations

import socket

from fulmar_bringup.console import log_line
from fulmar_bringup.domains import claimed_domain
from fulmar_bringup.node_spec import CONTROLLER
from fulmar_bringup.processes import ProcessGroup
from fulmar_bringup.readiness import raise_if_ended, while_starting
from fulmar_bringup.remote_parts import domain_text, mismatch
from fulmar_bringup.run_executor import STOPPED, passed_s, raise_if_silent, silence_limits_s
from fulmar_bringup.run_plan import RunPlan
from fulmar_bringup.standing_system import Ending, Show, described, report_newest, trips_of
from fulmar_bringup.supervisor import Supervisor, supervisor
from fulmar_bringup.system_events import Emit, SystemEvents
from fulmar_bringup.system_rows import system_rows
from fulmar_core.config.errors import ConfigError, RunFailed
from fulmar_ros.node_identity import STARTED_NS


def keep_controller_up(plan: RunPlan, emit: Emit, show: Show) -> Ending:
    """Run the controller of a system until Ctrl-C or SIGTERM, beside a plant that runs in another place.

    The controller starts once its plant reports, and ends with it: a plant that is started again meets a new
    controller, which has no goal, so that nothing moves until a new one is given.

    Args:
        plan: Of a standing system, with `only` set to the controller.
        emit: Called with each event; see `SystemEvents`. The first is `started`.
        show: Called several times a second with time, distance and mode.

    Returns:
        How it ended.

    Raises:
        ConfigError: The plant belongs to another system, or the robot has a controller already.
    """
    group = ProcessGroup()
    trips: int | None = None
    try:
        with claimed_domain(plan.robot_name, CONTROLLER), supervisor(plan) as overseer:
            try:
                _control(plan, overseer, group, emit, show)
            finally:
                trips = trips_of(overseer.plant)
    except RunFailed as error:
        return Ending(str(error), trips)
    except KeyboardInterrupt as stop:
        emit("stopping", reason=str(stop) or STOPPED)
    finally:
        ends = group.stop_all()
    bad = [end.text for end in ends if end.returncode != 0]
    return Ending("; ".join(bad), trips)


def _control(plan: RunPlan, overseer: Supervisor, group: ProcessGroup, emit: Emit, show: Show) -> None:
    """Control one plant after the other, until a signal comes or the controller ends.

    Raises:
        RunFailed: The controller ended or hangs.
        ConfigError: As in `keep_controller_up`.
    """
    events, own = SystemEvents(emit), set[str]()
    first = True
    while True:
        _wait_for_plant(plan, overseer, own)
        group.start(system_rows(plan)[CONTROLLER])
        own.add(str(group.process(CONTROLLER).pid))
        overseer.wait_until(
            lambda: overseer.controller.values.get("pid", "") in own, while_starting(group, overseer)
        )
        if first:
            emit("started", **described(plan), name=plan.robot_name, bag=None)
        else:
            emit("recovered", time_s=round(passed_s(plan, overseer.plant), 3), node="plant")
        first = False
        lost = _follow(plan, overseer, group, events, show)
        emit("fault", time_s=round(passed_s(plan, overseer.plant), 3), node="plant", reason=lost)
        group.stop(CONTROLLER)
        overseer.plant.forget()
        overseer.controller.forget()
        events.forget_controller()


def _wait_for_plant(plan: RunPlan, overseer: Supervisor, own: set[str]) -> None:
    """Wait for the plant's status, for ever, and check it.

    Raises:
        ConfigError: The plant belongs to another system, or another controller of the robot reports.
    """
    if not overseer.plant.received_s:
        log_line(f"waiting for the plant of '{plan.robot_name}', in {domain_text()}")
    overseer.wait_until(lambda: overseer.plant.received_s > 0.0, lambda: None)
    problem = mismatch(plan, overseer.plant)
    if problem:
        raise ConfigError(problem)
    other = overseer.controller.values
    here = other.get("host") == socket.gethostname()
    if overseer.controller.received_s and not (here and other.get("pid") in own):
        raise ConfigError(
            f"'{plan.robot_name}' has a controller already: process {other.get('pid', '?')} on host "
            f"{other.get('host', '?')}, in {domain_text()}. Of two the plant obeys none: stop that one first."
        )


def _follow(
    plan: RunPlan, overseer: Supervisor, group: ProcessGroup, events: SystemEvents, show: Show
) -> str:
    """Report what happens until the plant is gone; returns how that shows.

    Raises:
        RunFailed: The controller ended or fell silent.
    """
    plant, controller = overseer.plant, overseer.controller
    plant_limit_s, controller_limit_s = silence_limits_s(plan)
    began = plant.values.get(STARTED_NS, "")

    def lost() -> str:
        if overseer.silent_s(plant) > plant_limit_s:
            return f"has not reported for {plant_limit_s:g} s; the controller waits for it to come back"
        if plant.values.get(STARTED_NS, "") != began:
            return "was started again; a new controller begins without a goal"
        return ""

    def report() -> bool:
        if lost():
            return True
        report_newest(plan, overseer, events, show)
        return False

    def running() -> None:
        raise_if_ended(group)
        raise_if_silent("controller", overseer.silent_s(controller), controller_limit_s)

    overseer.wait_until(report, running)
    return lost()
