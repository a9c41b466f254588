"""A whole fleet that runs in real time, and one robot of which something is going to be done to."""

from __future__ import annotations

import contextlib
import os
import sys
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import psutil
from rclpy.node import Node

from fulmar_bringup.fleet_plan import FleetPlan
from fulmar_bringup.launched_command import LaunchedCommand
from fulmar_bringup.run_plan import RunPlan
from fulmar_core.config.errors import RunFailed
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.wires.robot_name import FLEET, namespace_of
from fulmar_evaluation.faults.fault import Fault
from fulmar_evaluation.faults.launched import ENDS
from fulmar_evaluation.faults.live_system import LiveSystem
from fulmar_evaluation.faults.observer import RunObserver, wait_for
from fulmar_ros.runtime import ros_nodes

SHARED = {"plant": FLEET}  # the process of all plants, by the part of the robot that it stands for
ENDS_S = 60.0  # for a run to end beyond its planned length, by the clock, on a busy computer
LATE = 1.5  # times as long as planned that a run in real time may take
NEWEST_S = 1.0  # a command that was applied longer ago is not applied any more: its plant is gone


class LiveFleet(LiveSystem):
    """A fleet that runs; everything of a `LiveSystem` is that of the robot that something is done to.

    Attributes:
        observers: Of the other robots, by name.
    """

    def __init__(
        self,
        fleet: FleetPlan,
        one: RunPlan,
        launched: LaunchedCommand,
        nodes: Mapping[str, Node],
        fault: Fault,
    ) -> None:
        """Hold the parts together.

        Args:
            fleet: Plan of all.
            one: Plan of the robot.
            launched: The process of the run.
            nodes: A node in the namespace of each robot, by name.
            fault: What is going to be done.
        """
        name = one.robot_name
        super().__init__(one, launched, nodes[name], fault.about, names=(name, FLEET))
        self.fleet = fleet
        self.observers = {
            other.robot_name: RunObserver(
                nodes[other.robot_name], load_robot(other.robot), names=(other.robot_name,)
            )
            for other in fleet.robots
            if other is not one
        }

    def process(self, name: str) -> psutil.Process:
        """Process of a node of the robot, or of one that all share."""
        return super().process(SHARED.get(name, name))

    def moving_others(self) -> list[str]:
        """Names of the other robots whose actuators are on."""
        since_s = time.monotonic() - NEWEST_S
        return [name for name, one in self.observers.items() if one.moves() and one.applied_since(since_s)]

    def results(self) -> dict[str, dict[str, Any]]:
        """How each robot did, once the run has ended; empty where its process was killed."""
        wait_for(lambda: self.has_ended, LATE * self.fleet.duration_s + ENDS_S)
        wait_for(lambda: any(event["event"] == ENDS for event in self.launched.events), NEWEST_S)
        return next((event["robots"] for event in self.launched.events if event["event"] == ENDS), {})


def command_of(fleet: FleetPlan, robot: str, fault: str) -> list[str]:
    """Command line of the run of a fleet, with what a fault needs at a robot."""
    module = "fulmar_evaluation.faults.launched_fleet"
    return [sys.executable, "-m", module, fleet.name, robot, fault, fleet.record, str(fleet.seed)]


@contextlib.contextmanager
def live_fleet(fleet: FleetPlan, robot: str, fault: Fault) -> Iterator[LiveFleet]:
    """A fleet on its way; ended at the end.

    Args:
        fleet: Plan of all, as `harmed_fleet` gives it.
        robot: Name of the robot that something is going to be done to.
        fault: What.

    Raises:
        RunFailed: An observer failed.
    """
    errors: list[Exception] = []
    one = next(plan for plan in fleet.robots if plan.robot_name == robot)
    spaces = [plan.namespace for plan in fleet.robots]
    with ros_nodes("bystander", errors.append, namespaces=spaces) as nodes:
        launched = LaunchedCommand(
            (),
            environment=dict(os.environ),
            folder=Path(fleet.record).parent,
            command=command_of(fleet, robot, fault.name),
            spaces=(one.namespace, namespace_of(FLEET)),
        )
        names = [plan.robot_name for plan in fleet.robots]
        live = LiveFleet(fleet, one, launched, dict(zip(names, nodes, strict=True)), fault)
        try:
            yield live
        finally:
            live.left_over = launched.end()
            live.others.stop_all()
    if errors:
        raise RunFailed(f"a bystander failed: {errors[0]!r}") from errors[0]
