"""A controller on another computer, and what happens to the cable to it."""

from __future__ import annotations

import time

from fulmar_bringup.faults.finding import Finding, stopped, went_on
from fulmar_bringup.faults.live_system import LiveSystem
from fulmar_bringup.faults.two_hosts import CUT, LOSSY

DRIVES_S = 8.0  # forty commands at 5 Hz


def cable_cut(live: LiveSystem) -> Finding:
    """Nothing passes any more, in either direction."""
    since_s = live.until_it_moves()
    live.hosts.cable.quality = CUT
    return stopped(live, "cable_cut", since_s, live.watchdog_s + live.tick_s + live.ramp_s)


def cable_lossy(live: LiveSystem) -> Finding:
    """A tenth of all frames is lost, and the others are 10 to 30 ms late, in both directions."""
    since_s = live.until_it_moves()
    live.hosts.cable.quality = LOSSY
    time.sleep(DRIVES_S)
    moved = any(moves for _, moves in live.witness.applied_since(since_s))
    said = f"driven for {DRIVES_S:g} s without a pause" if moved else "the robot stood still"
    return went_on(live, "cable_lossy", since_s, detected_by="", reaction=said, told=moved)


NETWORK_FAULTS = (cable_cut, cable_lossy)
