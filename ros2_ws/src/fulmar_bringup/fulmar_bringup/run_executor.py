"""One run from start to finish: start the nodes, give the goal, watch the run, stop the nodes."""

from __future__ import annotations

import contextlib
import shutil
import signal
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from fulmar_bringup.bag_origin import attachments, run_info
from fulmar_bringup.console import log_line
from fulmar_bringup.domains import claimed_domain
from fulmar_bringup.node_keeper import NodeKeeper, OnRestart, Restart
from fulmar_bringup.node_spec import NodeSpec
from fulmar_bringup.processes import Ended, ProcessGroup
from fulmar_bringup.progress import state_words, time_bar
from fulmar_bringup.readiness import (
    CONTROLLER_AND_RECORDER,
    raise_if_ended,
    wait_for_publisher,
    wait_for_reader,
    while_starting,
)
from fulmar_bringup.run_plan import RunPlan
from fulmar_bringup.supervisor import Report, Supervisor, supervisor
from fulmar_bringup.system_events import distance_of, mode_of
from fulmar_bringup.system_rows import system_rows
from fulmar_core.config.errors import BAD_USAGE, ConfigError, RunFailed
from fulmar_core.robots.actuators.refuge import LANDS_S
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import SIMULATION_START_NS
from fulmar_core.safety.estop import HOLDS
from fulmar_core.safety.watchdog import NO_COMMAND
from fulmar_ros.living_plant import TwinRunError
from hardware_drivers.hardware import load_hardware
from hardware_drivers.presence import check_presence
from policy_server.controllers import controller_entry

STOPPED = "stopped by the user"
LAST_WORDS_S = 0.5  # after a controller died, the plant still shows that its actuators are safe
SILENT_S = 2.0  # a controller without a status for so long hangs, in real time
PLANT_SILENT_S = 3.0  # the same for a plant, which publishes its status once a second
LOCKSTEP_SILENT_S = 10.0  # in lock step both are busy, and a plant itself waits 5 s for an answer
STALLED_S = 20.0  # in lock step, a simulated time that stands still for so long will not go on


@dataclass(frozen=True)
class Execution:
    """How the processes of a run ended."""

    failure: str  # why it did not come to its planned end; empty if it did
    plant_steps: int  # commands that the plant received in lock step
    warnings: tuple[str, ...] = ()  # of the launcher, such as nodes that it started again


def execute(plan: RunPlan) -> Execution:
    """Run once; the bag then lies at `plan.record`.

    Raises:
        ConfigError: Another run goes on in this ROS domain, a plant of this name lives in it, or the plant refused its
            configuration.
        DeviceError: The device is not there.
    """
    return run_nodes(plan, _watch)


Watch = Callable[[RunPlan, Supervisor, ProcessGroup, NodeKeeper], str]


def run_nodes(plan: RunPlan, watch: Watch, on_restart: OnRestart = lambda *_: None) -> Execution:
    """Start every node of a plan, watch them, and stop them in order.

    What cannot stop is brought to the ground before its plant ends, whatever ended the run. A second Ctrl-C cuts that
    short.

    Args:
        plan: What to run.
        watch: Called once the processes are started; gets them ready, waits for the end, and returns why the run
            failed, empty if it did not.
        on_restart: Called with the name of a node that was started again, and why.

    Raises:
        ConfigError: As in `execute`.
        DeviceError: The device is not there.
    """
    if plan.is_real:
        check_presence(load_hardware(plan.hardware).driver)
    with claimed_domain(plan.robot_name, plan.only):
        return _run(replace(plan, supervised=True), watch, on_restart)


def _run(plan: RunPlan, watch: Watch, on_restart: OnRestart) -> Execution:
    group = ProcessGroup()
    failure, plant, ends, restarts = "", Report(), list[Ended](), list[Restart]()
    folders = contextlib.ExitStack()
    try:
        folder = tempfile.TemporaryDirectory(prefix="fulmar_", ignore_cleanup_errors=True)
        wires_folder = Path(folders.enter_context(folder))  # for the wires of an emulator that are files
        record = {"directory": plan.record, "info": run_info(plan), "files": attachments(plan)}
        specs = list(system_rows(plan, record=record, wires_folder=wires_folder).values())
        for spec in specs:
            group.start(spec)
        with supervisor(plan) as overseer:
            if overseer.sees_living_plant():
                _withdraw(group, specs, plan.record)
                overseer.refuse_living_plant()
                for spec in specs:
                    group.start(spec)
            plant = overseer.plant
            keeper = NodeKeeper(group, overseer, on_restart)
            restarts = keeper.restarts
            try:
                failure = watch(plan, overseer, group, keeper)
            except TwinRunError:  # before anything has run
                _withdraw(group, specs, plan.record)
                raise
            except KeyboardInterrupt as stop:
                failure = str(stop) or STOPPED
                if not _lands(group):
                    overseer.stop_plant()  # one that goes on would miss the commands of a controller that ends
            if _lands(group):
                _bring_down(overseer, group)
            # The controller first: the plant then shows that its actuators are safe, and the recorder sees it.
            ends += group.stop("controller")
            ends += group.stop("plant")
    except KeyboardInterrupt as stop:
        failure = str(stop) or STOPPED
    finally:
        ends += group.stop_all()
        folders.close()
    if any(end.name == "plant" and end.returncode == BAD_USAGE for end in ends):
        shutil.rmtree(plan.record, ignore_errors=True)  # nothing has run
        raise ConfigError(failure)
    warnings = tuple(restart.warning for restart in restarts)
    return Execution(with_ends(failure, ends), int(plant.values.get("steps", 0)), warnings)


def _withdraw(group: ProcessGroup, specs: list[NodeSpec], record: str) -> None:
    """Stop nodes that have just been started, all at once, before they publish anything.

    They start while discovery looks for others, so that the look costs no time. It ends before they are up.
    """
    group.stop(*(spec.name for spec in specs))
    shutil.rmtree(record, ignore_errors=True)  # absent before; a quick recorder may have made it


def with_ends(failure: str, ends: list[Ended]) -> str:
    """Add the children that did not end well when they were stopped, unless the failure names them already."""
    # SIGTERM itself ends a child only before its handler is installed, and then nothing is lost.
    bad = [end for end in ends if not end.optional and end.returncode not in (0, -signal.SIGTERM)]
    if failure:
        bad = [end for end in bad if end.name not in failure and not end.forced]
    return "; ".join([*([failure] if failure else []), *(f"{end.text} when it was stopped" for end in bad)])


def _watch(plan: RunPlan, overseer: Supervisor, group: ProcessGroup, keeper: NodeKeeper) -> str:
    """Start the run and wait for its end; returns why it failed, or an empty text."""
    external = controller_entry(plan.controller).is_external
    assert plan.mission is not None  # as in `completed`
    try:
        if external:
            wait_for_publisher(plan, overseer, lambda: raise_if_ended(group))
        starting = while_starting(group, overseer)
        now_ns = time.time_ns() if plan.hardware else SIMULATION_START_NS
        if not plan.goals and external:
            overseer.publish_goal(plan.mission, time_ns=now_ns, alive=starting)
        elif not plan.goals:
            overseer.give_goal(
                plan.mission, time_ns=now_ns, alive=starting, listeners=CONTROLLER_AND_RECORDER
            )
        elif not external:
            overseer.wait_until(lambda: overseer.controller.values.get("mode") == "armed", starting)
        overseer.start_plant(starting, lambda: group.last_words("plant"))
        if external:
            wait_for_reader(plan, overseer, lambda: raise_if_ended(group))
        with time_bar("running", plan.duration_s) as moved:
            _wait_for_end(plan, overseer, keeper, moved, end_on_estop=plan.end_on_estop)
    except RunFailed as error:
        time.sleep(LAST_WORDS_S)
        return with_plant_reaction(str(error), overseer)
    return ""


def _lands(group: ProcessGroup) -> bool:
    """Whether the plant flies what cannot stop, which it brings down before it ends."""
    return "plant" in group.specs and group.specs["plant"].ends_within_s > 0.0


def _bring_down(overseer: Supervisor, group: ProcessGroup) -> None:
    """Ask the plant of what cannot stop to end, and wait while it flies down; Ctrl-C cuts that short.

    Nobody waits for a plant that has ended or hangs, nor for one that does not run.
    """
    plant, until_s = group.process("plant"), time.monotonic() + group.specs["plant"].ends_within_s
    if overseer.plant.values.get("mode") != "running" or overseer.silent_s(overseer.plant) > PLANT_SILENT_S:
        return
    log_line(f"the safe controller flies the robot down, within {LANDS_S:g} s; Ctrl-C ends it at once")
    group.ask_to_stop("plant")
    try:
        overseer.listen()
        while plant.poll() is None and time.monotonic() < until_s:
            if overseer.silent_s(overseer.plant) > PLANT_SILENT_S:
                return
            time.sleep(0.1)
    except KeyboardInterrupt:  # the reason of the run's end stays as it is
        group.ask_to_stop("plant", at_once=True)


def _wait_for_end(
    plan: RunPlan,
    overseer: Supervisor,
    keeper: NodeKeeper,
    moved: Callable[[float, str], None],
    *,
    end_on_estop: bool,
) -> None:
    """Watch a run until its time is over; an e-stop holds the robot meanwhile, and ends the run only if asked to."""
    watch = EndWatch(plan, overseer, keeper, end_on_estop=end_on_estop)

    def running() -> None:
        plant, controller = overseer.plant, overseer.controller
        moved(passed_s(plan, plant), state_words(distance_of(controller.values), mode_of(plant, controller)))
        watch.look()

    overseer.wait_until(watch.finished, running)
    if watch.errors:
        raise RunFailed(f"plant: {watch.errors[0]}")
    running()


class EndWatch:
    """Watches one robot of a run: whether it goes on, fails, or has come to its planned end.

    Attributes:
        errors: Of the plant, the first of which ended the run.
    """

    def __init__(
        self,
        plan: RunPlan,
        overseer: Supervisor,
        keeper: NodeKeeper,
        *,
        end_on_estop: bool,
        patience: float = 1.0,
    ) -> None:
        """Begin with the run; in lock step, silences may be `patience` times as long as those of a robot alone."""
        self._plan, self._overseer, self._keeper = plan, overseer, keeper
        self._end_on_estop, self._began = end_on_estop, time.monotonic()
        longer = patience if plan.lockstep else 1.0
        self._plant_limit_s, self._controller_limit_s = (longer * limit for limit in silence_limits_s(plan))
        limit_s = 30.0 + 1.5 * plan.duration_s / plan.rate
        self._limit_s = limit_s + (
            LANDS_S if plan.hardware and not load_robot(plan.robot).kind.rests else 0.0
        )
        self._steps = Stall(overseer)
        self.errors: list[str] = []

    def _failed(self) -> bool:
        overseer = self._overseer
        message = overseer.plant.message
        held = message.startswith(HOLDS) and not self._end_on_estop
        # Before the controller acts, a late command changes nothing; one that hangs or dies is noticed all the same.
        waits = message.startswith(NO_COMMAND) and overseer.controller.values.get("mode") == "armed"
        return overseer.plant.level == "error" and not (held or waits)

    def look(self) -> None:
        """Look at the processes and at what they report.

        Raises:
            RunFailed: The run cannot go on.
        """
        self._keeper.look()
        plan, overseer = self._plan, self._overseer
        if self._failed():
            raise RunFailed(f"plant: {overseer.plant.message}")
        if overseer.controller.level == "error":
            raise RunFailed(f"controller: {overseer.controller.message}")
        raise_if_silent("controller", overseer.silent_s(overseer.controller), self._controller_limit_s)
        raise_if_silent("plant", overseer.silent_s(overseer.plant), self._plant_limit_s)
        if plan.lockstep:  # which takes as long as it takes, as long as it goes on
            self._steps.look(passed_s(plan, overseer.plant))
        elif time.monotonic() - self._began > self._limit_s:
            raise RunFailed(f"the run did not end within {self._limit_s:.0f} s of wall-clock time")

    def finished(self) -> bool:
        """Whether the run is over, or has failed."""
        if self._failed():
            self.errors.append(
                self._overseer.plant.message
            )  # kept: a command that comes now takes the error back
        return bool(self.errors) or self._overseer.plant.values.get("mode") == "finished"


class Stall:
    """Notices that a run in lock step does not go on."""

    def __init__(self, overseer: Supervisor) -> None:
        """Begin with nothing done; time in which the overseer does not listen itself does not count."""
        self._overseer, self._passed_s, self._moved_s = overseer, -1.0, time.monotonic()

    def look(self, passed_s: float) -> None:
        """Look at how much of the run is over now [s].

        Raises:
            RunFailed: It has been as much for too long.
        """
        if passed_s != self._passed_s:
            self._passed_s, self._moved_s = passed_s, time.monotonic()
        elif self._overseer.since_s(self._moved_s) > STALLED_S:
            raise RunFailed(
                f"the run stands still: {passed_s:.2f} s of it were over {STALLED_S:g} s of wall-clock time ago, and "
                "no more are. Look at the output of its nodes."
            )


def passed_s(plan: RunPlan, plant: Report) -> float:
    """How much of a run is over [s]."""
    if plan.hardware:
        return float(plant.values.get("ticks") or 0.0) * load_robot(plan.robot).timing.physics_dt
    return max(0.0, float(plant.values.get("sim_time_s") or 0.0) - SIMULATION_START_NS / 1e9)


def silence_limits_s(plan: RunPlan) -> tuple[float, float]:
    """How long plant and controller may be silent, in wall-clock time [s]."""
    if plan.lockstep:
        return LOCKSTEP_SILENT_S, LOCKSTEP_SILENT_S
    return PLANT_SILENT_S, max(SILENT_S, 3.0 / (plan.control_hz * plan.rate))


def raise_if_silent(name: str, silent_s: float, limit_s: float) -> None:
    """Raise RunFailed for a node that has been silent for longer than a limit [s]."""
    if silent_s > limit_s:
        raise RunFailed(f"{name}: has not reported for {silent_s:.1f} s; it hangs")


def with_plant_reaction(reason: str, overseer: Supervisor) -> str:
    """Why a run failed, and what the plant reported of it."""
    reaction = overseer.plant.message
    if overseer.plant.level == "error" and reaction not in reason:
        return f"{reason}; plant: {reaction}"
    return reason
