"""Waiting for nodes to get ready: those of a run, and an external controller."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

from fulmar_bringup.console import log_line
from fulmar_bringup.processes import ProcessGroup
from fulmar_bringup.run_plan import RunPlan
from fulmar_bringup.supervisor import START_TIMEOUT_S, Report, Supervisor
from fulmar_core.config.errors import RunFailed
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import ODOMETRY, Wire, command_wire
from fulmar_core.robots.wire_check import Offer, wire_problems
from fulmar_ros.recorder_health import COMMANDERS
from hardware_drivers.adapter_node import message_class
from hardware_drivers.hardware import TOPIC_DRIVERS, load_hardware

EXTERNAL_TIMEOUT_S = 20.0  # for an external controller to publish, and to read
CONTROLLER_AND_RECORDER = 2  # nodes that receive the goal before anything moves


def raise_if_ended(group: ProcessGroup) -> None:
    """Raise RunFailed where a process has ended; with its name, how it ended and, after an error, its last line."""
    end = group.ended()
    if end is not None:
        words = group.last_words(end.name, ended=True) if (end.returncode or 0) > 0 else ""
        raise RunFailed(f"{end.text} before the run was over" + (f": {words}" if words else ""))


def while_starting(group: ProcessGroup, overseer: Supervisor, more_s: float = 0.0) -> Callable[[], None]:
    """A check to call while nodes get ready, for `START_TIMEOUT_S` and `more_s` at most [s].

    It raises RunFailed once a process ended or the time is over, and TwinRunError where another run of this name
    begins at the same time.
    """
    began_s, within_s = time.monotonic(), START_TIMEOUT_S + more_s

    def alive() -> None:
        overseer.refuse_twins()  # first: they make each other's nodes end
        raise_if_ended(group)
        if time.monotonic() - began_s > within_s:
            plant, controller = _last_status(overseer.plant), _last_status(overseer.controller)
            raise RunFailed(
                f"the nodes did not get ready within {within_s:g} s (the plant said: {plant}; "
                f"the controller said: {controller}). "
                "Is another system running in this ROS domain? Try `fulmar doctor`."
            )

    return alive


def _last_status(report: Report) -> str:
    """Last status of a node and its age: a node that went silent has another fault than one without news."""
    if not report.received_s:
        return "nothing"
    refused = report.values.get("goal_refused")
    more = f" (it refused the goal: {refused})" if refused else ""
    return f"{report.message or report.level}{more}, {time.monotonic() - report.received_s:.1f} s ago"


@dataclass(frozen=True)
class CommandInput:
    """Where the commands of an external controller come in."""

    topic: str  # full name
    wire: Wire  # what it carries
    reliable: bool  # whether its subscriber asks for reliable delivery


def command_input(plan: RunPlan) -> CommandInput:
    """The command topic of a plan's robot, or the topic that its adapter takes."""
    wire, reliable = command_wire(load_robot(plan.robot)), plan.lockstep
    topic = dict(plan.remappings).get(wire.name, wire.name)
    if plan.adapter:
        driver = load_hardware(plan.adapter).driver
        assert isinstance(driver, TOPIC_DRIVERS)  # as `adapter_path` has checked
        kind = message_class(driver)
        wire = replace(wire, type=f"{kind.__module__.partition('.')[0]}/msg/{kind.__name__}")
        topic, reliable = plan.adapter_topic or driver.topic, False
    return CommandInput(topic if topic.startswith("/") else f"{plan.namespace}/{topic}", wire, reliable)


def wait_for_publisher(plan: RunPlan, overseer: Supervisor, alive: Callable[[], None]) -> None:
    """Wait until a node publishes the commands of a plan; `alive` is called while waiting and raises to give up.

    Raises:
        RunFailed: No publisher fits within the time for it; with those that do not, and why.
    """
    entry, began_s = command_input(plan), time.monotonic()
    domain = os.environ.get("ROS_DOMAIN_ID") or "0"

    def problems(offers: list[Offer]) -> list[str]:
        return wire_problems(entry.wire, entry.topic, offers, reliable=entry.reliable)

    def fits() -> bool:
        return any(not problems([offer]) for offer in overseer.offers(entry.topic))

    def ready() -> bool:
        """Commands that came before the recorder is matched would be missing in the bag."""
        return fits() and int(overseer.recorder.values.get(COMMANDERS, 0)) > 0

    def waiting() -> None:
        alive()
        if time.monotonic() - began_s > EXTERNAL_TIMEOUT_S:
            unfit = "".join(f" {problem}." for problem in problems(overseer.offers(entry.topic)))
            raise RunFailed(
                f"no publisher on {entry.topic} within {EXTERNAL_TIMEOUT_S:g} s.{unfit} Start your controller, in ROS "
                f"domain {domain}; it publishes {entry.wire.type}."
            )

    if not fits():
        log_line(
            f"waiting for your controller: a publisher of {entry.wire.type} on {entry.topic}, in ROS domain {domain}"
        )
    overseer.wait_until(ready, waiting)


def wait_for_reader(plan: RunPlan, overseer: Supervisor, alive: Callable[[], None]) -> None:
    """Wait until a plant in lock step, which was started, has its subscribers; `alive` as in `wait_for_publisher`.

    Raises:
        RunFailed: Too few nodes subscribe its odometry within the time for it.
    """
    if not plan.lockstep:
        return
    began_s = time.monotonic()

    def waiting() -> None:
        alive()
        if time.monotonic() - began_s > EXTERNAL_TIMEOUT_S:
            topic = dict(plan.remappings).get(ODOMETRY.name, ODOMETRY.name)
            raise RunFailed(
                f"the plant did not begin within {EXTERNAL_TIMEOUT_S:g} s ({overseer.plant.message}). In lock step "
                f"your controller subscribes {topic} of '{plan.robot_name}' and answers each message by its stamp."
            )

    overseer.wait_until(
        lambda: overseer.plant.values.get("mode", "inactive") not in ("inactive", "waiting"), waiting
    )
