"""Nodes that die or hang while the robot moves."""

from __future__ import annotations

import signal

from fulmar_bringup.bag_reader import read_run
from fulmar_bringup.faults.finding import Finding, stopped, went_on
from fulmar_bringup.faults.live_system import LiveSystem
from fulmar_bringup.faults.witness import wait_for
from fulmar_core.errors import BagError
from fulmar_core.safety.estop import TIMEOUT_NS

ESTOP_S = TIMEOUT_NS / 1e9
PAUSE_S = 2.0


def controller_killed(live: LiveSystem) -> Finding:
    """SIGKILL of the node that commands."""
    return _controller(live, "controller_killed", signal.SIGKILL)


def controller_hangs(live: LiveSystem) -> Finding:
    """SIGSTOP of the node that commands."""
    return _controller(live, "controller_hangs", signal.SIGSTOP)


def _controller(live: LiveSystem, name: str, number: signal.Signals) -> Finding:
    since_s = live.until_it_moves()
    live.send("controller", number)
    return stopped(live, name, since_s, live.watchdog_s + live.tick_s + live.ramp_s)


def estop_killed(live: LiveSystem) -> Finding:
    """SIGKILL of the e-stop: its silence counts as pressed."""
    return _estop(live, "estop_killed", signal.SIGKILL)


def estop_hangs(live: LiveSystem) -> Finding:
    """SIGSTOP of the e-stop."""
    return _estop(live, "estop_hangs", signal.SIGSTOP)


def _estop(live: LiveSystem, name: str, number: signal.Signals) -> Finding:
    since_s = live.until_it_moves()
    live.send("estop", number)
    return stopped(live, name, since_s, ESTOP_S + live.tick_s + live.ramp_s)


def recorder_killed(live: LiveSystem) -> Finding:
    """SIGKILL of the recorder, which is a power cut to the bag: control goes on, and the bag opens."""
    since_s = live.until_it_moves()
    wait_for(lambda: False, PAUSE_S)  # the bag gets something to lose
    live.send("recorder", signal.SIGKILL)
    wait_for(lambda: False, PAUSE_S)
    try:
        record = read_run(live.record)
    except BagError as error:
        return went_on(live, "recorder_killed", since_s, detected_by="", reaction=str(error), told=False)
    count = len(record.commanded.log_s)
    said = f"control goes on; the bag opens with {count} commands"
    ended = live.group.ended()
    who = "launcher" if ended is not None and ended.name == "recorder" else ""
    return went_on(
        live, "recorder_killed", since_s, detected_by=who, reaction=said, told=count > 0 and bool(who)
    )
