"""A whole system that runs in real time, as people start it, and that something is going to be done to."""

from __future__ import annotations

import contextlib
import os
import signal
import threading
import time
from collections.abc import Callable, Collection, Iterator
from dataclasses import replace
from pathlib import Path

import psutil
import rclpy
from rclpy.node import Node

from fulmar_bringup.launched_command import LaunchedCommand
from fulmar_bringup.processes import ProcessGroup
from fulmar_bringup.run_plan import RunPlan
from fulmar_bringup.teleop_row import teleop_spec
from fulmar_core.config.errors import RunFailed
from fulmar_core.loop.controller_settings import MOST_COPIES
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import (
    ACTUATORS_STATE,
    DEVICE_STATE,
    GOAL_WIRES,
    ODOMETRY,
    SIMULATION_START_NS,
    Wire,
    command_wire,
)
from fulmar_core.safety.estop import TIMEOUT_NS
from fulmar_core.tasks import load_task
from fulmar_core.wires.silence import default_timeout
from fulmar_evaluation.faults.fault_environment import (
    FROM_PLANT,
    USUAL,
    FaultEnvironment,
    FaultInjector,
    source_of,
)
from fulmar_evaluation.faults.flight_watch import FlightWatch
from fulmar_evaluation.faults.launched import ENDS, RUN, UP, command_of
from fulmar_evaluation.faults.observer import RunObserver, wait_for
from fulmar_evaluation.faults.stepped_clock import SteppedClock
from fulmar_evaluation.faults.two_hosts import TwoHosts
from fulmar_ros.goal_messages import TYPES, goal_message
from fulmar_ros.qos import publisher_qos
from fulmar_ros.runtime import ros_node

START_S = 60.0  # for a system to come up, on a busy computer
MOVING_S = 20.0  # a robot that has far to go moves by then, once its plant runs
RECORD_S = 1.0  # and the next state that moves it comes
MATCH_S = 10.0  # for a publisher and its subscribers to find one another
STOPPED = "stopped by"  # how the reason of an end begins that a person asked for
ASKED_S = 0.5  # between two requests to end
MOST_S = 300.0  # of a run: no fault takes as long


class NothingShown(RunFailed):
    """The robot stood still when the fault was done: what it does then shows nothing."""


class LiveSystem:
    """A launcher with recorder, plant, e-stop and controller, and an observer of them.

    Attributes:
        launched: The process of `fulmar run` or `fulmar up`.
        launcher: Which of them.
        others: Nodes that people start beside it.
        left_over: Nodes of the launcher that had to be killed after its end.
    """

    def __init__(
        self,
        plan: RunPlan,
        launched: LaunchedCommand,
        bystander: Node,
        about: FaultEnvironment = USUAL,
        hosts: TwoHosts | None = None,
        launcher: str = RUN,
        clock: SteppedClock | None = None,
        names: Collection[str] = (),
    ) -> None:
        """Hold the parts together; `names` as in `RunObserver`."""
        self.plan, self.record, self.launched, self.launcher = plan, Path(plan.record), launched, launcher
        self.bystander, self._hosts, self._clock = bystander, hosts, clock
        self.others = ProcessGroup()
        self.left_over: list[str] = []
        robot = load_robot(self.plan.robot)
        self.robot = robot
        self.flight = flight = FlightWatch(bystander, self.plan.frames) if not robot.kind.rests else None
        applied = DEVICE_STATE if about.emulated else ACTUATORS_STATE
        downs = {} if flight is None else {"is_down": flight.is_down}
        self.observer = RunObserver(bystander, robot, applied, **downs, names=names)
        wire = command_wire(robot)
        self._answers = FaultInjector(bystander, wire) if about.answers_pass else None
        self._injector = (
            self._answers if about.intercepted is None else FaultInjector(bystander, about.intercepted)
        )
        self.tick_s, self.beat_s = robot.timing.physics_dt, 1.0 / self.plan.control_hz
        self.watchdog_s = default_timeout(self.beat_s)
        actuators = robot.actuators
        pairs = zip(actuators.scale, actuators.response.slew, strict=False)
        # As fast as commands may change. A plant that stops by itself asks for it only where wheels would slide.
        slew_s = max((float(most / rate) for most, rate in pairs), default=0.0)
        self.ramp_s = actuators.refuge.longest_s
        # From the last command to standstill.
        self.silenced_s = self.watchdog_s + self.tick_s + self.ramp_s
        # From the last message of the e-stop to the same: a plant looks at each tick.
        self.estop_silent_s = 1e-9 * TIMEOUT_NS + 2.0 * self.tick_s + self.ramp_s
        # From what a controller notices to the same.
        self.corrected_s = self.beat_s + 2.0 * self.tick_s + slew_s

    @property
    def hosts(self) -> TwoHosts:
        """The hosts that plant and controller are on; there must be two."""
        assert self._hosts is not None
        return self._hosts

    @property
    def clock(self) -> SteppedClock:
        """The clock of a node that may step; there must be one."""
        assert self._clock is not None
        return self._clock

    @property
    def injector(self) -> FaultInjector:
        """What the intercepted messages pass through; of a system where nothing else does, its commands."""
        assert self._injector is not None
        return self._injector

    @property
    def answers(self) -> FaultInjector:
        """What commands pass through, beside the measurements; they must."""
        assert self._answers is not None
        return self._answers

    def begin(self) -> None:
        """Wait until the system is up, and give a goal to one that has none yet.

        Raises:
            RunFailed: The launcher has ended, or the system is not up in time.
        """
        self.until(lambda: bool(self._controller_mode()), "controller")
        if self.launcher == UP:
            self.until(lambda: self._controller_mode() != "idle", "controller")
            self._give_goal()
        self.until(lambda: len(self.observer.received()[0]) > 0, "plant")

    def until(self, condition: Callable[[], bool], what: str) -> None:
        """Wait for something of a system that starts.

        Raises:
            RunFailed: The launcher has ended, or it did not come in time.
        """
        wait_for(lambda: condition() or self.has_ended, START_S)
        if not condition():
            reason = self.failure or f"{what} was not there within {START_S:g} s"
            raise RunFailed(f"the system did not come up: {reason}")

    def _give_goal(self) -> None:
        """As `fulmar goals` gives one to a system that is up."""
        wire, form = GOAL_WIRES[load_task(self.plan.task, self.plan.thing).goal_topic], self.robot.state_type
        now_ns = time.time_ns() if self.plan.hardware else SIMULATION_START_NS
        assert self.plan.mission is not None  # as in `completed`
        message = goal_message(self.plan.mission, wire.name, now_ns, self.plan.frames, form=form)
        publisher = self.bystander.create_publisher(TYPES[wire.name], wire.name, publisher_qos(wire))
        wait_for(lambda: publisher.get_subscription_count() > 0, MATCH_S)
        publisher.publish(message)

    def _controller_mode(self) -> str:
        statuses = [status for status in self.observer.statuses_since(0.0) if status.who == "controller"]
        return next((each.values["mode"] for each in reversed(statuses) if "mode" in each.values), "")

    @property
    def has_ended(self) -> bool:
        """Whether the launcher has ended."""
        return self.launched.process.poll() is not None

    @property
    def failure(self) -> str:
        """Why the launcher has ended; empty while it runs, and where somebody stopped it."""
        ends = [event["failure"] or "" for event in self.launched.events if event["event"] == ENDS]
        return "" if not ends or str(ends[0]).startswith(STOPPED) else str(ends[0])

    def said(self, *words: str) -> str:
        """The newest line of the launcher's log with all these words; empty where it has said nothing like it."""
        lines = (line for line in reversed(list(self.launched.log)) if all(word in line for word in words))
        return next(lines, "")

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
            NothingShown: As in `until_it_moves`.
        """
        since_s = self.until_it_moves()
        if not wait_for(lambda: any(moves for _, moves in self.observer.applied_since(since_s)), RECORD_S):
            raise NothingShown("the robot stopped by itself before the fault; the fault would show nothing")
        return since_s

    @contextlib.contextmanager
    def stranger(self) -> Iterator[Node]:
        """Another node in the namespace of the robot."""
        node = rclpy.create_node("stranger", namespace=self.plan.namespace)
        try:
            yield node
        finally:
            node.destroy_node()

    def signal_launcher(self, number: signal.Signals) -> None:
        """Send a signal to the launcher, if it still runs."""
        if not self.has_ended:
            self.launched.process.send_signal(number)

    def process(self, name: str) -> psutil.Process:
        """Process of a node."""
        with contextlib.suppress(KeyError):
            return self.others.process(name)
        return self.launched.node(name)

    def send(self, name: str, number: signal.Signals) -> None:
        """Send a signal to a node."""
        self.process(name).send_signal(number)


@contextlib.contextmanager
def repeated(publish: Callable[[], None], every_s: float) -> Iterator[None]:
    """Publish something again and again meanwhile, in a thread of its own [s]."""
    over = threading.Event()

    def talk() -> None:
        while not over.wait(every_s):
            publish()

    thread = threading.Thread(target=talk, name="repeated", daemon=True)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()


@contextlib.contextmanager
def live_system(
    plan: RunPlan,
    about: FaultEnvironment = USUAL,
    hosts: TwoHosts | None = None,
    launcher: str = RUN,
) -> Iterator[LiveSystem]:
    """A system that a launcher has started, on its way to its goal after `begin`; ended at the end.

    Args:
        plan: What to run.
        about: What is unusual about it; the same that the plan was made with.
        hosts: The controller is on the other one, everything else on the robot's, which this thread has to be on.
        launcher: `run` or `up`.

    Raises:
        RunFailed: Its observer failed.
    """
    length_s = MOST_S if launcher == RUN else 0.0
    plan = replace(plan, intercepted=interceptions(plan, about), duration_s=length_s)
    if hosts is not None:
        plan = replace(plan, controller_network=hosts.other, copies=MOST_COPIES)
    errors: list[Exception] = []
    with contextlib.ExitStack() as stack:
        bystander = stack.enter_context(ros_node("bystander", errors.append, namespace=plan.namespace))
        folder = Path(plan.record).parent
        clock = SteppedClock(folder, about.clock_of) if about.clock_of else None
        variables = {**os.environ, **(clock.environment if clock is not None else {})}
        launched = LaunchedCommand(
            (), environment=variables, folder=folder, command=command_of(launcher, plan, folder)
        )
        live = LiveSystem(plan, launched, bystander, about, hosts, launcher, clock)
        try:
            if about.by_hand:
                live.others.start(teleop_spec(plan.robot, name=plan.name, keyboard=False))
            yield live
        finally:
            if live.flight is not None:  # which is flown down first; a second request cuts that short
                for number in (signal.SIGTERM, signal.SIGINT):
                    live.signal_launcher(number)
                    time.sleep(ASKED_S)
            live.left_over = launched.end()
            live.others.stop_all()
    if errors:
        raise RunFailed(f"the bystander failed: {errors[0]!r}") from errors[0]


def interceptions(plan: RunPlan, about: FaultEnvironment) -> tuple[tuple[str, str, str], ...]:
    """Outputs of nodes that the injectors pass on, as in `RunPlan.intercepted`."""
    commands = command_wire(load_robot(plan.robot))
    wires = [about.intercepted] if about.intercepted is not None else []
    wires += [commands] if about.answers_pass else []
    return tuple((_publisher_of(wire, plan), wire.name, source_of(wire)) for wire in wires)


def _publisher_of(wire: Wire, plan: RunPlan) -> str:
    if wire == ODOMETRY:  # it may have come from another process
        return "estimator" if plan.guards.estimator else "plant"
    return "plant" if wire in FROM_PLANT else "controller"
