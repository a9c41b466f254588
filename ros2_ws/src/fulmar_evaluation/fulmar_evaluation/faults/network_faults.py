"""A controller on another computer, and what happens to the cable to it."""

from __future__ import annotations

import time

from fulmar_core.robot import Robot
from fulmar_evaluation.faults.fault import Fault, Outcome, stopped, went_on
from fulmar_evaluation.faults.fault_environment import FaultEnvironment
from fulmar_evaluation.faults.live_system import LiveSystem
from fulmar_evaluation.faults.two_hosts import CUT, LOSSY, why_not

DRIVES_S = 8.0  # forty commands at 5 Hz


def cable_cut(live: LiveSystem) -> Outcome:
    """Nothing passes any more, in either direction."""
    since_s = live.until_it_moves()
    live.hosts.cable.quality = CUT
    return stopped(live, since_s, live.silenced_s)


def cable_lossy(live: LiveSystem) -> Outcome:
    """A tenth of all frames is lost, and the others are 10 to 30 ms late, in both directions."""
    since_s = live.until_it_moves()
    live.hosts.cable.quality = LOSSY
    time.sleep(DRIVES_S)
    said = f"driven for {DRIVES_S:g} s without a pause"
    return went_on(live, since_s, detected_by="", reaction=said, told=True)


def _why_not(_robot: Robot) -> str:
    return why_not()


NETWORK_FAULTS = tuple(
    Fault(do, FaultEnvironment(two_hosts=True), _why_not) for do in (cable_cut, cable_lossy)
)
