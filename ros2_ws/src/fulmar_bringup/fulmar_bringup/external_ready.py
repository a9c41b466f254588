"""Readiness of an external controller: its publisher of commands is matched."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

from fulmar_bringup.console import console
from fulmar_bringup.node_table import RunPlan
from fulmar_bringup.supervisor import Supervisor
from fulmar_core.errors import RunFailed
from fulmar_core.robot import load_robot
from fulmar_core.topics import ODOMETRY, Wire, command_wire
from fulmar_core.wire_check import Offer, wire_problems
from fulmar_ros.recorder_health import COMMANDERS
from hardware_drivers.adapter_node import message_class
from hardware_drivers.settings import TOPIC_DRIVERS, load_hardware

TIMEOUT_S = 20.0


@dataclass(frozen=True)
class CommandInput:
    """Where the commands of an external controller come in."""

    topic: str  # full name
    wire: Wire  # what it carries
    reliable: bool  # whether its subscriber asks for reliable delivery


def command_input(plan: RunPlan) -> CommandInput:
    """The command topic of a plan's robot, or the topic that its adapter takes."""
    wire, reliable = command_wire(load_robot(plan.robot)), True  # the recorder asks for it
    topic = dict(plan.remappings).get(wire.name, wire.name)
    if plan.adapter:
        driver = load_hardware(plan.adapter).driver
        assert isinstance(driver, TOPIC_DRIVERS)  # as `adapter_path` has checked
        kind = message_class(driver)
        wire = replace(wire, type=f"{kind.__module__.partition('.')[0]}/msg/{kind.__name__}")
        topic, reliable = plan.adapter_topic or driver.topic, False
    return CommandInput(topic if topic.startswith("/") else f"{plan.namespace}/{topic}", wire, reliable)


def wait_for_publisher(plan: RunPlan, overseer: Supervisor, alive: Callable[[], None]) -> None:
    """Wait until a node publishes the commands that a plan waits for.

    Args:
        plan: What runs.
        overseer: Sees who publishes.
        alive: Called while waiting; raises to give up.

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
        if time.monotonic() - began_s > TIMEOUT_S:
            unfit = "".join(f" {problem}." for problem in problems(overseer.offers(entry.topic)))
            raise RunFailed(
                f"no publisher on {entry.topic} within {TIMEOUT_S:g} s.{unfit} Start your controller, in ROS domain "
                f"{domain}; it publishes {entry.wire.type}."
            )

    if not fits():
        console.print(
            f"waiting for your controller: a publisher of {entry.wire.type} on {entry.topic}, in ROS domain {domain}",
            markup=False,
            soft_wrap=True,
        )
    overseer.wait_until(ready, waiting)


def wait_for_reader(plan: RunPlan, overseer: Supervisor, alive: Callable[[], None]) -> None:
    """Wait until a plant in lock step, which has been started, no longer waits for subscribers.

    Args:
        plan: What runs.
        overseer: Receives what the plant reports.
        alive: Called while waiting; raises to give up.

    Raises:
        RunFailed: Too few nodes subscribe its odometry within the time for it.
    """
    if not plan.lockstep:
        return
    began_s = time.monotonic()

    def waiting() -> None:
        alive()
        if time.monotonic() - began_s > TIMEOUT_S:
            topic = dict(plan.remappings).get(ODOMETRY.name, ODOMETRY.name)
            raise RunFailed(
                f"the plant did not begin within {TIMEOUT_S:g} s ({overseer.plant.message}). In lock step your "
                f"controller subscribes {topic} of '{plan.robot_name}' and answers each message by its stamp."
            )

    overseer.wait_until(
        lambda: overseer.plant.values.get("mode", "inactive") not in ("inactive", "waiting"), waiting
    )
