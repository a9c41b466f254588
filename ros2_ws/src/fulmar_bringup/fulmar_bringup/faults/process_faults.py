"""Nodes that die or hang while the robot moves."""

from __future__ import annotations

import signal
from dataclasses import replace

import psutil

from fulmar_bringup.bag_reader import read_run
from fulmar_bringup.faults.finding import Finding, stopped, went_on
from fulmar_bringup.faults.live_system import LiveSystem
from fulmar_bringup.faults.witness import Word, wait_for
from fulmar_core.errors import BagError
from fulmar_core.safety.estop import TIMEOUT_NS

ESTOP_S = TIMEOUT_NS / 1e9
PAUSE_S = 2.0
COMPLAINT_S = 10.0  # a recorder looks at its disk now and then


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


def plant_killed(live: LiveSystem) -> Finding:
    """SIGKILL of the plant: no actuator is told anything any more, and the controller commands what is safe."""
    return _plant(live, "plant_killed", signal.SIGKILL)


def plant_hangs(live: LiveSystem) -> Finding:
    """SIGSTOP of the plant."""
    return _plant(live, "plant_hangs", signal.SIGSTOP)


def _plant(live: LiveSystem, name: str, number: signal.Signals) -> Finding:
    """Nothing is applied from then on; what a device then does by itself is another matter."""
    since_s = live.until_it_moves()
    live.send("plant", number)
    limit_s = live.watchdog_s + live.beat_s + live.tick_s
    found = stopped(live, name, since_s, limit_s)
    last_s = max((heard_s for heard_s, _ in live.witness.applied_since(since_s)), default=since_s) - since_s
    return replace(found, time_to_safe_s=last_s, passed=last_s <= limit_s and bool(found.detected_by))


def recorder_killed(live: LiveSystem) -> Finding:
    """SIGKILL of the recorder, which is a power cut to the bag: control goes on, and the bag opens."""
    since_s = live.until_it_moves()
    wait_for(lambda: False, PAUSE_S)  # the bag gets something to lose
    live.send("recorder", signal.SIGKILL)
    wait_for(lambda: False, PAUSE_S)
    ended = live.group.ended()
    who = "launcher" if ended is not None and ended.name == "recorder" else ""
    return _recorded(live, "recorder_killed", since_s, who)


def recorder_hangs(live: LiveSystem) -> Finding:
    """SIGSTOP of the recorder for a while: nobody waits for it, and what it missed is in the bag afterwards."""
    since_s = live.until_it_moves()
    live.send("recorder", signal.SIGSTOP)
    wait_for(lambda: False, PAUSE_S)
    live.send("recorder", signal.SIGCONT)
    wait_for(lambda: False, PAUSE_S)
    return _recorded(live, "recorder_hangs", since_s, None)


def disk_full(live: LiveSystem) -> Finding:
    """The recorder cannot write a byte more, as on a full disk: control goes on, and what was written opens."""
    since_s = live.until_it_moves()
    wait_for(lambda: False, PAUSE_S)
    recorder = live.group.process("recorder")
    recorder.rlimit(psutil.RLIMIT_FSIZE, (0, recorder.rlimit(psutil.RLIMIT_FSIZE)[1]))
    wait_for(lambda: _complaint(live, since_s) is not None, COMPLAINT_S)
    word = _complaint(live, since_s)
    found = _recorded(live, "disk_full", since_s, word.who if word else "")
    return replace(found, reaction=f"{word.text}; {found.reaction}") if word else replace(found, passed=False)


def _complaint(live: LiveSystem, since_s: float) -> Word | None:
    words = [word for word in live.witness.words_since(since_s) if word.who == "recorder"]
    return next((word for word in words if word.level != "ok"), None)


def _recorded(live: LiveSystem, name: str, since_s: float, detected_by: str | None) -> Finding:
    """Control goes on, and the bag opens as it lies there; `detected_by` is None where nobody has to notice."""
    try:
        count = len(read_run(live.record).commanded)
    except BagError as error:
        return went_on(live, name, since_s, detected_by=detected_by or "", reaction=str(error), told=False)
    told = count > 0 and detected_by != ""
    said = f"control goes on; the bag opens with {count} commands"
    return went_on(live, name, since_s, detected_by=detected_by or "", reaction=said, told=told)


PROCESS_FAULTS = (
    controller_killed,
    controller_hangs,
    plant_killed,
    plant_hangs,
    estop_killed,
    estop_hangs,
    recorder_killed,
    recorder_hangs,
    disk_full,
)
