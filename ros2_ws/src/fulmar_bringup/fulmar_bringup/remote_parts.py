"""The part of a split system that runs in another place, as this place sees it: its controller, or its plant."""

from __future__ import annotations

import os
import time

from fulmar_bringup.node_spec import PLANT
from fulmar_bringup.run_plan import RunPlan
from fulmar_bringup.supervisor import Report
from fulmar_bringup.system_events import SystemEvents
from fulmar_core.robots.robot_file import load_robot
from fulmar_ros.node_identity import STARTED_NS, differences, setup_of


def mismatch(plan: RunPlan, other: Report) -> str:
    """How the other part's robot, task and rates differ from ours, in a sentence; empty where they agree."""
    robot = load_robot(plan.robot)
    found = differences(
        other.values, setup_of(plan.robot, plan.task, plan.control_hz or robot.timing.control_hz, plan.rate)
    )
    if not found:
        return ""
    where = f"process {other.values.get('pid', '?')} on host {other.values.get('host', '?')}"
    kind = "controller" if plan.only == PLANT else "plant"
    return (
        f"the {kind} of '{plan.robot_name}' ({where}) belongs to another system: {'; '.join(found)}. "
        "Start both parts with the same system and options."
    )


def domain_text() -> str:
    """The ROS domain of this process, for people."""
    return f"ROS domain {os.environ.get('ROS_DOMAIN_ID') or '0'}"


class RemoteController:
    """A controller that may come, die and come back while its plant runs on."""

    def __init__(self, plan: RunPlan, report: Report, *, silent_s: float) -> None:
        """Look at the reports of a controller, which is gone once it is silent for `silent_s` [s]."""
        self._plan, self._report, self._silent_s = plan, report, silent_s
        self._started = ""  # of the process that reported last

    def look(self, events: SystemEvents) -> None:
        """Put an error in the report of a controller that is gone, or that belongs to another system."""
        report = self._report
        if not report.received_s:
            return
        if time.monotonic() - report.received_s > self._silent_s:
            report.level, report.values = "error", {}
            report.message = f"has not reported for {self._silent_s:g} s; the plant runs on without it"
            return
        started = report.values.get(STARTED_NS, "")
        if self._started and started and started != self._started:
            events.forget_controller()
        self._started = started or self._started
        problem = mismatch(self._plan, report)
        if problem:
            report.level, report.message = "error", problem
