"""A whole system that runs in real time and that something is going to be done to."""

from __future__ import annotations

import contextlib
import signal
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import rclpy

from fulmar_bringup.faults.spoiler import MEASURED, Spoiler
from fulmar_bringup.faults.two_hosts import TwoHosts
from fulmar_bringup.faults.witness import Witness, wait_for
from fulmar_bringup.node_table import (
    NodeSpec,
    RunPlan,
    controller_spec,
    guard_specs,
    plant_spec,
    recorder_spec,
)
from fulmar_bringup.planning import RunRequest
from fulmar_bringup.processes import ProcessGroup
from fulmar_bringup.starting import CONTROLLER_AND_RECORDER, while_starting
from fulmar_bringup.supervisor import supervisor
from fulmar_core.errors import RunFailed
from fulmar_core.robot import load_robot
from fulmar_core.safety.watchdog import default_timeout
from fulmar_core.tasks import load_task
from fulmar_core.topics import ODOMETRY, SIMULATION_START_NS
from fulmar_ros.controller_settings import MOST_COPIES
from fulmar_ros.runtime import spinning

MOVING_S = 20.0  # a robot that has far to go moves by then


class LiveSystem:
    """Recorder, plant, e-stop, controller, and a bystander who hears them."""

    def __init__(
        self,
        plan: RunPlan,
        record: Path,
        group: ProcessGroup,
        witness: Witness,
        spoiler: Spoiler,
        hosts: TwoHosts | None,
    ) -> None:
        """Hold the parts together."""
        self.plan, self.record, self.group = plan, record, group
        self._hosts = hosts
        self.witness, self.spoiler = witness, spoiler
        robot = load_robot(plan.robot)
        self.robot = robot
        self.tick_s, self.beat_s = robot.timing.physics_dt, 1.0 / plan.control_hz
        self.watchdog_s = default_timeout(self.beat_s)
        slew = robot.actuators.response.slew
        # A drive that stops at once would slide: it slows down as fast as its commands may change.
        self.ramp_s = max(
            (most / rate for most, rate in zip(robot.actuators.scale, slew, strict=False)), default=0.0
        )

    @property
    def hosts(self) -> TwoHosts:
        """The hosts that plant and controller are on; there must be two."""
        assert self._hosts is not None
        return self._hosts

    def until_it_moves(self) -> float:
        """Wait until actuators are on.

        Returns:
            Now, on the monotonic clock [s].

        Raises:
            RunFailed: They stay off.
        """
        if not wait_for(self.witness.moves, MOVING_S):
            raise RunFailed(f"the robot did not move within {MOVING_S:g} s; the fault would show nothing")
        return time.monotonic()

    def send(self, name: str, number: signal.Signals) -> None:
        """Send a signal to a node."""
        self.group.process(name).send_signal(number)


@contextlib.contextmanager
def live_system(request: RunRequest, hosts: TwoHosts | None = None) -> Iterator[LiveSystem]:
    """A system on its way to its goal, with its odometry passing through a spoiler; ended at the end.

    Args:
        request: What to run.
        hosts: The controller is on the other one, everything else on the robot's, which this thread has to be on.

    Raises:
        RunFailed: It does not come up.
    """
    plan = replace(request.plan, supervised=True)
    if hosts is not None:
        plan = replace(plan, controller_network=hosts.other, copies=MOST_COPIES)
    group = ProcessGroup()
    robot, task = load_robot(plan.robot), load_task(plan.task)
    with supervisor(plan.robot, task) as overseer:
        node = rclpy.create_node("bystander", namespace=f"/{plan.robot}")
        errors: list[Exception] = []
        with spinning(node, errors.append):
            live = LiveSystem(plan, request.record, group, Witness(node, robot), Spoiler(node), hosts)
            try:
                for spec in _specs(plan, request.record):
                    group.start(spec)
                alive = while_starting(group, overseer)
                overseer.give_goal(
                    request.mission,
                    time_ns=SIMULATION_START_NS,
                    alive=alive,
                    listeners=CONTROLLER_AND_RECORDER,
                )
                overseer.start_plant(alive, lambda: group.last_words("plant"))
                yield live
            finally:
                group.stop("controller")
                group.stop_all()
    if errors:
        raise RunFailed(f"the bystander failed: {errors[0]!r}") from errors[0]


def _specs(plan: RunPlan, record: Path) -> list[NodeSpec]:
    plant = replace(plant_spec(plan, subscribers=1), remappings={ODOMETRY.name: MEASURED})
    return [recorder_spec(plan, directory=str(record)), plant, *guard_specs(plan), controller_spec(plan)]
