"""A whole system that runs in real time and that something is going to be done to."""

from __future__ import annotations

import contextlib
import signal
import tempfile
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import rclpy
from rclpy.node import Node

from fulmar_bringup.operator_rows import teleop_spec
from fulmar_bringup.planning import RunRequest
from fulmar_bringup.processes import ProcessGroup
from fulmar_bringup.readiness import CONTROLLER_AND_RECORDER, while_starting
from fulmar_bringup.run_plan import NodeSpec, RunPlan
from fulmar_bringup.supervisor import Supervisor, supervisor
from fulmar_bringup.system_rows import system_rows
from fulmar_core.controller_settings import MOST_COPIES
from fulmar_core.errors import RunFailed
from fulmar_core.robot import Robot, load_robot
from fulmar_core.safety.watchdog import default_timeout
from fulmar_core.topics import (
    ACTUATORS_STATE,
    DEVICE_STATE,
    IMU,
    MOCAP,
    ODOMETRY,
    SIMULATION_START_NS,
    Wire,
    command_wire,
)
from fulmar_evaluation.faults.fault_environment import USUAL, FaultEnvironment, FaultInjector, source_of
from fulmar_evaluation.faults.flight_watch import FlightWatch
from fulmar_evaluation.faults.observer import RunObserver, wait_for
from fulmar_evaluation.faults.two_hosts import TwoHosts
from fulmar_ros.runtime import spinning

MOVING_S = 20.0  # a robot that has far to go moves by then
RECORD_S = 1.0  # and the next state that moves it comes


class NothingShown(RunFailed):
    """The robot stood still when the fault was done: what it does then shows nothing."""


class LiveSystem:
    """Recorder, plant, e-stop, controller, and an observer of them."""

    def __init__(
        self,
        request: RunRequest,
        group: ProcessGroup,
        overseer: Supervisor,
        bystander: Node,
        about: FaultEnvironment,
        hosts: TwoHosts | None,
    ) -> None:
        """Hold the parts together."""
        self.plan, self.record, self.group = request.plan, request.record, group
        self.bystander, self._request, self._overseer, self._hosts = bystander, request, overseer, hosts
        robot = load_robot(self.plan.robot)
        self.robot = robot
        self.observer = RunObserver(bystander, robot, DEVICE_STATE if about.emulated else ACTUATORS_STATE)
        self.flight = FlightWatch(bystander, self.plan.frames) if robot.flies else None
        # The safe controller of an aircraft bridges a pause of 50 ms, which an ordinary thread may have.
        wire = command_wire(robot)
        self.injector = FaultInjector(bystander, about.intercepted or wire, prior=robot.flies)
        self._answers = FaultInjector(bystander, wire, prior=robot.flies) if about.answers_pass else None
        self.tick_s, self.beat_s = robot.timing.physics_dt, 1.0 / self.plan.control_hz
        self.watchdog_s = default_timeout(self.beat_s)
        actuators = robot.actuators
        pairs = zip(actuators.scale, actuators.response.slew, strict=False)
        # As fast as commands may change. A plant that stops by itself asks for it only where wheels would slide.
        slew_s = max((float(most / rate) for most, rate in pairs), default=0.0)
        self.ramp_s = actuators.refuge.longest_s
        # From the last command to standstill.
        self.silenced_s = self.watchdog_s + self.tick_s + self.ramp_s
        # From what a controller notices to the same.
        self.corrected_s = self.beat_s + 2.0 * self.tick_s + slew_s

    @property
    def hosts(self) -> TwoHosts:
        """The hosts that plant and controller are on; there must be two."""
        assert self._hosts is not None
        return self._hosts

    @property
    def answers(self) -> FaultInjector:
        """What commands pass through, beside the measurements; they must."""
        assert self._answers is not None
        return self._answers

    def begin(self) -> None:
        """Give the goal, and start the plant.

        Raises:
            RunFailed: A node has ended, or is not ready in time.
        """
        alive, controller = while_starting(self.group, self._overseer), self._overseer.controller
        if self.plan.goals:
            self._overseer.wait_until(lambda: controller.values.get("mode") == "armed", alive)
        else:
            self._overseer.give_goal(
                self._request.mission,
                time_ns=time.time_ns() if self.plan.hardware else SIMULATION_START_NS,
                alive=alive,
                listeners=CONTROLLER_AND_RECORDER,
            )
        self._overseer.start_plant(alive, lambda: self.group.last_words("plant"))

    def start_plant_alone(self) -> None:
        """Start the plant, whoever has ended.

        Raises:
            RunFailed: It refuses.
        """
        self._overseer.start_plant(lambda: None, lambda: self.group.last_words("plant"))

    def until_it_moves(self) -> float:
        """Wait until actuators are on; of an aircraft, until it flies level.

        Returns:
            Now, on the monotonic clock [s].

        Raises:
            NothingShown: They stay off.
        """
        if self.flight is not None and not wait_for(self.flight.is_level, MOVING_S):
            raise NothingShown(
                f"the craft did not fly level within {MOVING_S:g} s; the fault would show nothing"
            )
        if not wait_for(self.observer.moves, MOVING_S):
            raise NothingShown(f"the robot did not move within {MOVING_S:g} s; the fault would show nothing")
        return time.monotonic()

    def until_a_move_is_on_record(self) -> float:
        """As `until_it_moves`, and a state that moves the robot comes after that time.

        For faults whose very next tick may be safe. The time is at most two ticks ago.

        Raises:
            NothingShown: As of `until_it_moves`.
        """
        since_s = self.until_it_moves()
        if not wait_for(lambda: any(moves for _, moves in self.observer.applied_since(since_s)), RECORD_S):
            raise NothingShown("the robot stopped by itself before the fault; the fault would show nothing")
        return since_s

    def send(self, name: str, number: signal.Signals) -> None:
        """Send a signal to a node."""
        self.group.process(name).send_signal(number)


@contextlib.contextmanager
def live_system(
    request: RunRequest, about: FaultEnvironment = USUAL, hosts: TwoHosts | None = None
) -> Iterator[LiveSystem]:
    """The processes of a system, which `begin` sets on its way to its goal; ended at the end.

    Args:
        request: What to run.
        about: What is unusual about it; the same that the request was made with.
        hosts: The controller is on the other one, everything else on the robot's, which this thread has to be on.

    Raises:
        RunFailed: It does not come up.
    """
    plan = replace(request.plan, supervised=True)
    if hosts is not None:
        plan = replace(plan, controller_network=hosts.other, copies=MOST_COPIES)
    request, group = replace(request, plan=plan), ProcessGroup()
    errors: list[Exception] = []
    with contextlib.ExitStack() as stack:
        wires = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="fulmar_")))
        overseer = stack.enter_context(supervisor(plan))
        bystander = rclpy.create_node("bystander", namespace=plan.namespace)
        stack.enter_context(spinning(bystander, errors.append))
        live = LiveSystem(request, group, overseer, bystander, about, hosts)
        try:
            for spec in _specs(request, about, live.robot, wires):
                group.start(spec)
            yield live
        finally:
            group.stop("controller")
            group.stop_all()
    if errors:
        raise RunFailed(f"the bystander failed: {errors[0]!r}") from errors[0]


def _specs(request: RunRequest, about: FaultEnvironment, robot: Robot, wires: Path) -> list[NodeSpec]:
    plan = request.plan
    rows = system_rows(plan, record={"directory": str(request.record)}, wires_folder=wires)
    specs = [
        *rows.values(),
        *([teleop_spec(plan.robot, name=plan.name, keyboard=False)] if about.by_hand else []),
    ]
    commands = command_wire(robot)
    intercepted = [about.intercepted or commands, *([commands] if about.answers_pass else [])]
    sources = {_publisher_of(wire, plan): {wire.name: source_of(wire)} for wire in intercepted}
    # Of an intercepted topic this process alone is the subscriber.
    return [
        replace(
            spec,
            remappings=sources[spec.name],
            parameters={**spec.parameters, "wait_for_subscribers": 1}
            if "wait_for_subscribers" in spec.parameters
            else spec.parameters,
        )
        if spec.name in sources
        else spec
        for spec in specs
    ]


def _publisher_of(wire: Wire, plan: RunPlan) -> str:
    if wire == ODOMETRY:  # it may have come from another process
        return "estimator" if plan.guards.estimator else "plant"
    return "plant" if wire in (MOCAP, IMU) else "controller"
