"""Every fault, each to a system of its own."""

from __future__ import annotations

import multiprocessing
import tempfile
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path

from fulmar_bringup.domains import reserved_domains
from fulmar_bringup.environment import environment
from fulmar_bringup.faults.command_faults import command_faults
from fulmar_bringup.faults.finding import Finding
from fulmar_bringup.faults.input_faults import INPUT_FAULTS
from fulmar_bringup.faults.live_system import LiveSystem, live_system
from fulmar_bringup.faults.network_faults import NETWORK_FAULTS
from fulmar_bringup.faults.policy_faults import POLICY_FAULTS
from fulmar_bringup.faults.process_faults import PROCESS_FAULTS
from fulmar_bringup.faults.two_hosts import ACROSS, inside, two_hosts, why_not
from fulmar_bringup.planning import RunRequest, default_task, plan_run
from fulmar_core.errors import ConfigError, RunFailed, UnknownNameError
from fulmar_core.robot import load_robot
from fulmar_core.topics import VELOCITY_COMMAND, command_wire

Fault = Callable[[LiveSystem], Finding]
FAR_M = 6.0  # the robot is under way for seconds


def faults_of(robot: str, names: list[str] | None = None) -> list[Fault]:
    """The faults that a robot can have, or some of them by name.

    Returns:
        Those asked for; by default every one that this machine can do.

    Raises:
        UnknownNameError: There is no such fault for it.
        ConfigError: This machine cannot do it.
    """
    has_names = command_wire(load_robot(robot)) is not VELOCITY_COMMAND
    every = {
        fault.__name__: fault
        for fault in (
            *PROCESS_FAULTS,
            *INPUT_FAULTS,
            *command_faults(has_names),
            *POLICY_FAULTS,
            *NETWORK_FAULTS,
        )
    }
    for name in names or ():
        if name not in every:
            raise UnknownNameError("fault", name, every)
        if every[name] in skipped_here():
            raise ConfigError(f"{name}: {why_not()}.")
    return [every[name] for name in names or every if every[name] not in skipped_here()]


def skipped_here() -> tuple[Fault, ...]:
    """Faults that this machine cannot do; `why_not` says why."""
    return NETWORK_FAULTS if why_not() else ()


def run_faults(robot: str, faults: list[Fault], progress: Callable[[int], None]) -> list[Finding]:
    """Do each of them to a system of its own, one after another, in a ROS domain that nobody else uses.

    Args:
        robot: Whose system.
        faults: From `faults_of`.
        progress: Told how many are over.
    """
    findings = []
    with reserved_domains(1) as (domain,), environment({"ROS_DOMAIN_ID": str(domain)}):
        for count, fault in enumerate(faults, 1):
            with tempfile.TemporaryDirectory(prefix="fulmar_", ignore_cleanup_errors=True) as folder:
                findings.append(_run(robot, fault, Path(folder)))
            progress(count)
    return findings


def _run(robot: str, fault: Fault, folder: Path) -> Finding:
    if fault in NETWORK_FAULTS:
        # In a process of its own: the middleware asks once in a process which networks there are.
        with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
            return pool.submit(_run_on_two_hosts, robot, fault, folder).result()
    try:
        with live_system(request_of(robot, folder / "bag")) as live:
            return fault(live)
    except RunFailed as error:
        return _not_done(fault, error)


def _run_on_two_hosts(robot: str, fault: Fault, folder: Path) -> Finding:
    request = request_of(robot, folder / "bag")
    try:
        with (
            environment(ACROSS),
            two_hosts() as hosts,
            inside(hosts.robot),
            live_system(request, hosts) as live,
        ):
            return fault(live)
    except RunFailed as error:
        return _not_done(fault, error)


def _not_done(fault: Fault, error: RunFailed) -> Finding:
    return Finding(fault.__name__, "", str(error), None, None, False)


def request_of(robot: str, record: Path) -> RunRequest:
    """A robot that has far to go, with an e-stop."""
    request = plan_run(
        robot=robot,
        task=default_task(robot),
        controller="policy",
        backend="mujoco",
        policy=None,
        goal=(FAR_M, 0.0, 0.0),
        start=(0.0, 0.0, 0.0),
        duration_s=None,
        lockstep=False,
        rate=1.0,
        control_hz=None,
        scenario="nominal",
        seed=0,
        record=record,
        command="fulmar faults",
        guards={"estop": True},
    )
    return replace(request, plan=replace(request.plan, duration_s=0.0))
