"""Every fault that one robot of a fleet can have, each done to a fleet of its own: the others have to arrive."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from std_msgs.msg import Bool

from fulmar_bringup.domains import reserved_domains
from fulmar_bringup.fleet_plan import FleetPlan
from fulmar_core.config.errors import ConfigError, FulmarError, UnknownNameError
from fulmar_core.config.process import environment
from fulmar_core.robots.topics import FLEET_ESTOP
from fulmar_evaluation.faults.fault import Fault, FaultResult, Outcome, stopped
from fulmar_evaluation.faults.fleet_environment import OF_ALL, harmed_fleet, row_of, why_not_in_fleet
from fulmar_evaluation.faults.fleet_system import LiveFleet, live_fleet
from fulmar_evaluation.faults.live_system import LiveSystem, NothingShown
from fulmar_evaluation.faults.observer import bag_evidence, wait_for
from fulmar_evaluation.faults.suite import ATTEMPTS, EVERY, Skipped, result_of
from fulmar_ros.qos import publisher_qos

MATCH_S = 10.0  # for the e-stop of all to find the plants and controllers
OF_EACH = 2  # nodes of a robot that subscribe the e-stop of all: its plant and its controller
GOOD = ("arrived", "safe")  # what may become of another robot
RESTS_S = 5.0  # for the last robot to rest, once the one that is watched does


@dataclass(frozen=True)
class FleetFaultResult(FaultResult):
    """One line of the report of a fleet.

    Attributes:
        others: What became of the other robots, by name: `arrived`, `safe`, or why they did not arrive.
    """

    others: dict[str, str] | None = None


def fleet_estop(live: LiveSystem) -> Outcome:
    """The e-stop of all, pressed once: every robot stops."""
    assert isinstance(live, LiveFleet)
    publisher = live.bystander.create_publisher(Bool, FLEET_ESTOP.name, publisher_qos(FLEET_ESTOP))
    needed = OF_EACH * len(live.fleet.robots)
    if not wait_for(lambda: publisher.get_subscription_count() >= needed, MATCH_S):
        raise NothingShown(f"fewer than {needed} nodes subscribe {FLEET_ESTOP.name} within {MATCH_S:g} s")
    since_s = live.until_a_move_is_on_record()
    publisher.publish(Bool(data=True))
    outcome = stopped(live, since_s, live.silenced_s)
    late = {
        name: max((s for s, moves in one.applied_since(since_s) if moves), default=since_s) - since_s
        for name, one in live.observers.items()
    }
    slow = [f"{name} moved {after_s:.2f} s" for name, after_s in late.items() if after_s > live.silenced_s]
    words = "; ".join([outcome.reaction, *slow])
    return replace(outcome, reaction=words, passed=outcome.passed and not slow)


FLEET_FAULTS = (*EVERY, Fault(fleet_estop))
KNOWN = {fault.name: fault for fault in FLEET_FAULTS}


def fleet_fault(name: str) -> Fault:
    """A fault by its name.

    Raises:
        UnknownNameError: There is none.
    """
    if name not in KNOWN:
        raise UnknownNameError("fault", name, KNOWN)
    return KNOWN[name]


def faults_of_fleet(
    fleet: str, robot: str = "", names: list[str] | None = None
) -> tuple[list[Fault], list[Skipped]]:
    """The faults that a robot of a fleet can have, or some of them by name.

    Args:
        fleet: Name of its file.
        robot: Name of the robot; empty: the first.
        names: Which; None for all.

    Returns:
        Those to do, and those of all that the robot cannot have.

    Raises:
        UnknownNameError: There is no such fault or robot.
        ConfigError: No name was given, or the robot cannot have the fault.
    """
    row = row_of(fleet, robot)
    reasons = {fault.name: why_not_in_fleet(fault, row) for fault in FLEET_FAULTS}
    if names is None:
        skipped = [Skipped(name, reason) for name, reason in reasons.items() if reason]
        return [fault for fault in FLEET_FAULTS if not reasons[fault.name]], skipped
    if not names:
        raise ConfigError(f"no fault is named. Leave it out for all, or name some of: {', '.join(KNOWN)}.")
    chosen = [fleet_fault(name) for name in dict.fromkeys(names)]
    for fault in chosen:
        if reasons[fault.name]:
            raise ConfigError(f"{fault.name}: {reasons[fault.name]}.")
    return chosen, []


def run_fleet_faults(
    fleet: str, robot: str, faults: list[Fault], progress: Callable[[int], None], times: int = 1
) -> list[FleetFaultResult]:
    """Do each of them to a fleet of its own, one after another, in a ROS domain of their own.

    Args:
        fleet: Name of its file.
        robot: Name of the robot that they are done to; empty: the first.
        faults: Which.
        progress: Called with the number of faults that are done.
        times: How often each is done.

    Raises:
        FulmarError: The fleet cannot run.
    """
    name, results = row_of(fleet, robot).called, list[FleetFaultResult]()
    with tempfile.TemporaryDirectory() as folder:
        harmed_fleet(fleet, name, Path(folder) / "bag")  # one that cannot run is refused once
    with reserved_domains(1) as (domain,), environment({"ROS_DOMAIN_ID": str(domain)}):
        for count, fault in enumerate(faults * times, 1):
            results.append(_result(fleet, name, fault))
            progress(count)
    return results


def _result(fleet: str, robot: str, fault: Fault) -> FleetFaultResult:
    """What came of a fault; whatever prevents it is reported, and the others go on."""
    problem = ""
    for _ in range(ATTEMPTS):
        with tempfile.TemporaryDirectory(prefix="fulmar_", ignore_cleanup_errors=True) as folder:
            try:
                return _done(harmed_fleet(fleet, robot, Path(folder) / "bag", fault.about), robot, fault)
            except NothingShown as error:
                problem = str(error)
            except FulmarError as error:
                problem = str(error)
                break
            except Exception as error:  # noqa: BLE001 - one fault that cannot be done must not lose the others
                problem = f"{type(error).__name__}: {error}"
                break
    return FleetFaultResult(fault.name, "", problem, None, None, None, None, passed=False, others={})


def _done(plan: FleetPlan, robot: str, fault: Fault) -> FleetFaultResult:
    with live_fleet(plan, robot, fault) as live:
        live.begin()
        outcome = fault.do(live)
        if fault.name in OF_ALL:
            wait_for(lambda: not live.moving_others(), RESTS_S)
            moving = live.moving_others()
            others = {name: "still moves" if name in moving else "safe" for name in live.observers}
        else:
            others = others_of(live.results(), list(live.observers))
    evidence = bag_evidence(
        Path(plan.record),
        live.observer,
        outcome.recorder_away,
        again=outcome.recorder_again,
        robot=robot,
    )
    found = result_of(fault, live, outcome, evidence)
    words = [f"{name}: {what}" for name, what in others.items()]
    passed = found.passed and all(what in GOOD for what in others.values())
    text = "; ".join(part for part in (found.reaction, *words) if part)
    return FleetFaultResult(**{**vars(found), "reaction": text, "passed": passed}, others=others)


def others_of(results: dict[str, dict[str, Any]], names: list[str]) -> dict[str, str]:
    """What became of the other robots.

    Args:
        results: `success` and `failure` of each robot of the fleet, by name; empty where the run gave none.
        names: Of the others.
    """
    found = {}
    for name in names:
        own = results.get(name)
        if own is None:
            found[name] = "the run gave no result"
        elif own["success"] and not own["failure"]:
            found[name] = "arrived"
        else:
            found[name] = own["failure"] or "did not arrive"
    return found
