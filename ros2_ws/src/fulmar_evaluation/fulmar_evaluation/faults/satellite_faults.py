"""Sensors of a satellite that die in flight."""

from __future__ import annotations

import time

from fulmar_core.robots.robot import Robot
from fulmar_core.robots.topics import IMU
from fulmar_evaluation.faults.fault import Fault, Outcome, went_on
from fulmar_evaluation.faults.fault_environment import FaultEnvironment, lost
from fulmar_evaluation.faults.live_system import LiveSystem
from fulmar_evaluation.faults.observer import wait_for

REPLACED_S = 10.0  # until the estimator has replaced a gyroscope that it lacks
GOES_ON_S = 5.0  # in which it is seen whether the controller goes on
SCENARIO = "gyro_dies"  # with event cameras at work; its own gyroscope dies later than ours


def gyroscope_dies(live: LiveSystem) -> Outcome:
    """The gyroscope falls silent: the attitude goes on with the turn rate that event cameras see in the stars."""
    since_s = live.until_it_moves()
    wait_for(lambda: _rate_source(live, since_s) == "gyroscope", REPLACED_S)
    live.injector.change = lost
    died_s = time.monotonic()
    replaced = wait_for(lambda: _rate_source(live, died_s) == "events", REPLACED_S)
    time.sleep(GOES_ON_S)
    source = _rate_source(live, died_s) or "nothing"
    return went_on(
        live,
        died_s,
        detected_by="estimator" if replaced else "",
        reaction=f"turn rate from {source}; control goes on",
        correct=replaced and source == "events",
    )


def _rate_source(live: LiveSystem, since_s: float) -> str:
    """What the estimator has last said that its turn rate comes from; empty if nothing since then."""
    statuses = live.observer.statuses_since(since_s)
    return next((each.values["rate_from"] for each in reversed(statuses) if "rate_from" in each.values), "")


def _without_events(robot: Robot) -> str:
    return "" if robot.event_cameras else f"'{robot.name}' has no event camera"


SATELLITE_FAULTS = (
    Fault(gyroscope_dies, FaultEnvironment(scenario=SCENARIO, intercepted=IMU, nadir=True), _without_events),
)
