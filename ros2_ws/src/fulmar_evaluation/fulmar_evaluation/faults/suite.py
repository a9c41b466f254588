"""Every fault, each to a system of its own."""

from __future__ import annotations

import multiprocessing
import os
import signal
import tempfile
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

from fulmar_bringup.domains import reserved_domains
from fulmar_bringup.system import default_hardware, modules_of
from fulmar_core.config.errors import ConfigError, FulmarError, UnknownNameError
from fulmar_core.config.process import end_with, environment
from fulmar_core.robots.robot_file import load_robot
from fulmar_evaluation.faults.actuator_faults import ACTUATOR_FAULTS
from fulmar_evaluation.faults.command_faults import CABLE_FAULTS, COMMAND_FAULTS
from fulmar_evaluation.faults.fault import Fault, FaultResult, Outcome
from fulmar_evaluation.faults.fault_environment import plan_of
from fulmar_evaluation.faults.hardware_faults import HARDWARE_FAULTS
from fulmar_evaluation.faults.host_faults import HOST_FAULTS
from fulmar_evaluation.faults.input_faults import INPUT_FAULTS
from fulmar_evaluation.faults.launched import LAUNCHERS, RUN, UP
from fulmar_evaluation.faults.limit_faults import LIMIT_FAULTS
from fulmar_evaluation.faults.live_system import LiveSystem, NothingShown, live_system
from fulmar_evaluation.faults.observer import BagEvidence, bag_evidence, wait_for
from fulmar_evaluation.faults.operator_faults import OPERATOR_FAULTS
from fulmar_evaluation.faults.policy_faults import POLICY_FAULTS
from fulmar_evaluation.faults.process_faults import PROCESS_FAULTS
from fulmar_evaluation.faults.sensor_faults import SENSOR_FAULTS
from fulmar_evaluation.faults.two_hosts import ACROSS, TwoHosts, inside, two_hosts

EVERY = (
    *PROCESS_FAULTS,
    *OPERATOR_FAULTS,
    *HARDWARE_FAULTS,
    *INPUT_FAULTS,
    *LIMIT_FAULTS,
    *COMMAND_FAULTS,
    *POLICY_FAULTS,
    *CABLE_FAULTS,
    *SENSOR_FAULTS,
    *ACTUATOR_FAULTS,
    *HOST_FAULTS,
)
BOTH = "both"  # launchers
ENDS_S = 4.0  # for a launcher to end after a robot got safe
ATTEMPTS = 3  # a robot may stand still just when something is done to it


@dataclass(frozen=True)
class Skipped:
    """A fault that is left out."""

    name: str
    reason: str


def faults_of(robot: str, names: list[str] | None = None) -> tuple[list[Fault], list[Skipped]]:
    """The faults that a robot can have, or some of them by name.

    Args:
        robot: Its name.
        names: Which; None for all.

    Returns:
        Those to do, and those of all that this robot or this machine cannot have.

    Raises:
        UnknownNameError: There is no such fault.
        ConfigError: No name was given, or this robot or this machine cannot have the fault.
    """
    known = {fault.name: fault for fault in EVERY}
    the_robot = load_robot(robot)
    if names is None:
        reasons = {fault.name: fault.inapplicable(the_robot) for fault in EVERY}
        skipped = [Skipped(name, reason) for name, reason in reasons.items() if reason]
        return [fault for fault in EVERY if not reasons[fault.name]], skipped
    if not names:
        raise ConfigError(f"no fault is named. Leave it out for all, or name some of: {', '.join(known)}.")
    for name in names:
        if name not in known:
            raise UnknownNameError("fault", name, known)
        reason = known[name].inapplicable(the_robot)
        if reason:
            raise ConfigError(f"{name}: {reason}.")
    return [known[name] for name in dict.fromkeys(names)], []


def modules_for(robot: str, faults: list[Fault]) -> tuple[str, ...]:
    """Modules of extras that the systems of some faults import."""
    needed: dict[str, None] = {}
    for about in (fault.about for fault in faults):
        backend, hardware = ("hardware", default_hardware(robot)) if about.emulated else ("mujoco", "")
        guards = about.guards_of(load_robot(robot))
        modules = modules_of(
            "policy", backend, guards=guards, hardware=hardware, emulated=about.emulated, camera=about.filmed
        )
        needed |= dict.fromkeys(modules)
    return tuple(needed)


def times_of(faults: list[Fault], launcher: str | None = None, times: int = 1) -> list[tuple[Fault, str]]:
    """Faults with the launcher of the system that each is done to.

    Args:
        faults: Which.
        launcher: run, up or both; None: that of each fault, both where they differ.
        times: How often each is done.

    Raises:
        UnknownNameError: It is none of these.
    """
    every = {RUN: (RUN,), UP: (UP,), BOTH: LAUNCHERS}
    if launcher is not None and launcher not in every:
        raise UnknownNameError("launcher", launcher, every)
    once = [(fault, each) for fault in faults for each in (every[launcher] if launcher else fault.launchers)]
    return once * times


def at_height(faults: list[Fault], robot: str, height_m: float) -> list[Fault]:
    """Faults of an aircraft that begins at another height [m].

    Raises:
        ConfigError: The robot is no aircraft.
    """
    if not load_robot(robot).flies:
        raise ConfigError(f"--height {height_m:g}: {robot} does not fly. Leave it out.")
    return [replace(fault, about=replace(fault.about, height_m=height_m)) for fault in faults]


def run_faults(
    robot: str,
    faults: list[Fault],
    progress: Callable[[int], None],
    launcher: str | None = None,
    times: int = 1,
) -> list[FaultResult]:
    """Do each of them to a system of its own, one after another, in a ROS domain of their own.

    Args:
        robot: Its name.
        faults: Which.
        progress: Called with the number of faults that are done, each launcher and time counted.
        launcher: As in `times_of`.
        times: Same.

    Raises:
        FulmarError: The robot has no controller to run.
    """
    with tempfile.TemporaryDirectory() as folder:
        plan_of(robot, Path(folder) / "bag")  # a robot without a policy is refused once, not by every fault
    results = []
    with reserved_domains(1) as (domain,), environment({"ROS_DOMAIN_ID": str(domain)}):
        for count, (fault, each) in enumerate(times_of(faults, launcher, times), 1):
            results.append(_result_of(robot, fault, each))
            progress(count)
    return results


def _result_of(robot: str, fault: Fault, launcher: str) -> FaultResult:
    """What came of a fault; whatever prevents it is reported, and the others go on."""
    problem = ""
    for _ in range(ATTEMPTS):
        with tempfile.TemporaryDirectory(prefix="fulmar_", ignore_cleanup_errors=True) as folder:
            try:
                return _done(robot, fault, launcher, Path(folder))
            except NothingShown as error:
                problem = str(error)
            except FulmarError as error:
                problem = str(error)
                break
            except Exception as error:  # noqa: BLE001 - one fault that cannot be done must not lose the others
                problem = f"{type(error).__name__}: {error}"
                break
    return FaultResult(fault.name, "", problem, None, None, None, None, passed=False, launcher=launcher)


def result_of(fault: Fault, live: LiveSystem, outcome: Outcome, evidence: BagEvidence) -> FaultResult:
    """One line of the report, of a fault that was done."""
    said = outcome.reaction, evidence.words and f"bag: {evidence.words}"
    left = live.left_over and f"left over: {', '.join(live.left_over)}"
    words = "; ".join(text for text in (*said, left) if text)
    return FaultResult(
        fault.name,
        outcome.detected_by,
        words,
        outcome.time_to_safe_s,
        outcome.limit_s,
        evidence.lost,
        evidence.intact,
        outcome.passed and evidence.intact and not live.left_over,
        live.launcher,
        live.failure,
    )


def _done(robot: str, fault: Fault, launcher: str, folder: Path) -> FaultResult:
    if not fault.about.two_hosts:
        return _do(robot, fault, launcher, folder, None)
    # In a process of its own: the middleware asks once in a process which networks there are.
    spawn = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(1, spawn, end_with, (os.getpid(), signal.SIGTERM)) as pool:
        return pool.submit(_do_on_two_hosts, robot, fault, launcher, folder).result()


def _do_on_two_hosts(robot: str, fault: Fault, launcher: str, folder: Path) -> FaultResult:
    with environment(ACROSS), two_hosts() as hosts, inside(hosts.robot):
        return _do(robot, fault, launcher, folder, hosts)


def _do(robot: str, fault: Fault, launcher: str, folder: Path, hosts: TwoHosts | None) -> FaultResult:
    plan = plan_of(robot, folder / "bag", fault.about)
    with live_system(plan, fault.about, hosts, launcher) as live:
        if fault.begins:
            live.begin()
        outcome = fault.do(live)
        # What stopped a robot may end its launcher; an aircraft is flown down first, which takes long.
        if outcome.time_to_safe_s is not None and live.flight is None:
            wait_for(lambda: live.has_ended, ENDS_S)
    away, again = outcome.recorder_away, outcome.recorder_again
    evidence = bag_evidence(Path(plan.record), live.observer, away, again=again)
    return result_of(fault, live, outcome, evidence)
