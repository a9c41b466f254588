"""Nodes that die or hang while the robot moves."""

from __future__ import annotations

import math
import signal
import time
from functools import partial

import psutil

from fulmar_core.estimators.kinds import default_estimator, load_estimator
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.topics import MOCAP
from fulmar_evaluation.faults.fault import (
    STAYS_S,
    WORDS_S,
    Fault,
    Outcome,
    killed_and_stopped,
    stopped,
    went_on,
)
from fulmar_evaluation.faults.fault_environment import FaultEnvironment, lost
from fulmar_evaluation.faults.launched import LAUNCHERS
from fulmar_evaluation.faults.live_system import LiveSystem
from fulmar_evaluation.faults.observer import HealthStatus, wait_for

PAUSE_S = 2.0
REPORT_S = 0.5  # what a recorder said before it died has come by then
AGAIN_S = 30.0  # for a recorder to be started again, on a busy computer
PROBLEM_S = 10.0  # a recorder looks at its disk now and then


def _controller(live: LiveSystem, number: signal.Signals) -> Outcome:
    """The node that commands."""
    return signalled(live, "controller", number, live.silenced_s)


def estop_killed(live: LiveSystem) -> Outcome:
    """SIGKILL of the e-stop: its silence counts as pressed, until another e-stop node is there.

    That one may come before wheels stand; they then follow commands, of which one may just have been missed.
    """
    return signalled(live, "estop", signal.SIGKILL, live.estop_silent_s + live.beat_s)


def estop_hangs(live: LiveSystem) -> Outcome:
    """SIGSTOP of the e-stop."""
    return signalled(live, "estop", signal.SIGSTOP, live.estop_silent_s)


def _estimator(live: LiveSystem, number: signal.Signals) -> Outcome:
    """The node that says where the robot is."""
    return signalled(live, "estimator", number, live.watchdog_s + live.corrected_s)


def mocap_lost(live: LiveSystem) -> Outcome:
    """No pose comes any more: the estimator bridges a gap of moments, and then says what it lacks."""
    bridge_s = load_estimator(default_estimator(live.robot)).bridge_s
    since_s = live.until_it_moves()
    live.injector.change = lost
    return stopped(live, since_s, bridge_s + live.watchdog_s + live.corrected_s)


def signalled(live: LiveSystem, name: str, number: signal.Signals, limit_s: float) -> Outcome:
    """Send a signal to one process while the robot moves; the robot has to stop within the limit [s]."""
    node = live.process(name)  # takes a tenth of a second
    since_s = live.until_it_moves()
    node.send_signal(number)
    return stopped(live, since_s, limit_s)


def _plant(live: LiveSystem, number: signal.Signals) -> Outcome:
    """The plant: no actuator receives anything any more, and the controller commands what is safe.

    What a device then does by itself is another matter.
    """
    node = live.process("plant")
    since_s = live.until_it_moves()
    node.send_signal(number)
    limit_s = live.watchdog_s + live.beat_s + live.tick_s
    time.sleep(limit_s + STAYS_S)
    wait_for(lambda: live.observer.problem_since(since_s) is not None, WORDS_S)
    status = live.observer.problem_since(since_s)
    last_s = (
        max((received_s for received_s, _ in live.observer.applied_since(since_s)), default=since_s) - since_s
    )
    passed = status is not None and last_s <= limit_s
    return Outcome(status.who if status else "", status.text if status else "", passed, last_s, limit_s)


def helper_lost(live: LiveSystem, number: signal.Signals, *, name: str) -> Outcome:
    """Send a signal to a node without which the robot goes on; the launcher has to start it again."""
    lost = live.process(name)
    since_s = live.until_it_moves()
    lost.send_signal(number)
    again = _is_started_again(live, lost, name)
    time.sleep(PAUSE_S)
    who, reaction = _launcher_on(live, name, number)
    return went_on(live, since_s, detected_by=who, reaction=reaction, correct=bool(who) and again)


def _is_started_again(live: LiveSystem, lost: psutil.Process, name: str) -> bool:
    """Whether a node that was lost runs again soon, in another process."""
    try:
        live.launched.node(name, other_than=lost.pid, timeout_s=AGAIN_S)
    except TimeoutError:
        return False
    return True


def _recorder(live: LiveSystem, number: signal.Signals) -> Outcome:
    """The recorder, a power cut to the bag: control goes on, and another recorder goes on with the bag."""
    since_s = live.until_it_moves()
    time.sleep(PAUSE_S)  # the bag gets something to lose
    lost = live.process("recorder")
    lost.send_signal(number)
    away_s = time.monotonic()
    again = _is_started_again(live, lost, "recorder")
    again = again and wait_for(lambda: _recorder_reports(live, away_s + REPORT_S), AGAIN_S)
    back_s = time.monotonic()
    time.sleep(PAUSE_S)
    who, reaction = _launcher_on(live, "recorder", number)
    return went_on(
        live,
        since_s,
        detected_by=who,
        reaction=reaction,
        correct=bool(who) and again,
        recorder_away=(away_s, back_s if again else math.inf),
        recorder_again=again,
    )


def _recorder_reports(live: LiveSystem, since_s: float) -> bool:
    return any(status.who == "recorder" for status in live.observer.statuses_since(since_s))


def recorder_hangs(live: LiveSystem) -> Outcome:
    """SIGSTOP of the recorder for a while: nobody waits for it. It misses what streams do not keep for so long."""
    since_s = live.until_it_moves()
    live.send("recorder", signal.SIGSTOP)
    time.sleep(PAUSE_S)
    live.send("recorder", signal.SIGCONT)
    away = since_s, time.monotonic()
    time.sleep(PAUSE_S)
    return went_on(
        live, since_s, detected_by="", reaction="control goes on", correct=True, recorder_away=away
    )


def disk_full(live: LiveSystem) -> Outcome:
    """The recorder cannot write a byte more, as on a full disk: control goes on, and what was written opens."""
    since_s = live.until_it_moves()
    time.sleep(PAUSE_S)
    recorder = live.process("recorder")
    recorder.rlimit(psutil.RLIMIT_FSIZE, (0, recorder.rlimit(psutil.RLIMIT_FSIZE)[1]))
    away_s = time.monotonic()
    wait_for(lambda: _problem(live, since_s) is not None, PROBLEM_S)
    status = _problem(live, since_s)
    reaction = f"{status.text}; control goes on" if status else "control goes on"
    return went_on(
        live,
        since_s,
        detected_by=status.who if status else "",
        reaction=reaction,
        correct=status is not None,
        recorder_away=(away_s, math.inf),
    )


def _launcher_on(live: LiveSystem, name: str, number: signal.Signals) -> tuple[str, str]:
    """Who noticed that a process was killed or stopped, and the words."""
    lost = live.said(name, "was killed" if number == signal.SIGKILL else "was stopped", "is started again")
    if not lost:
        return "", f"the launcher did not report the loss of {name}"
    return "launcher", f"{lost}; control goes on"


def _problem(live: LiveSystem, since_s: float) -> HealthStatus | None:
    statuses = [status for status in live.observer.statuses_since(since_s) if status.who == "recorder"]
    return next((status for status in statuses if status.level != "ok"), None)


def _without_camera(robot: Robot) -> str:
    return "" if robot.sensors.camera is not None else f"'{robot.name}' has no camera"


PROCESS_FAULTS = (
    *killed_and_stopped(_controller, "controller_killed", "controller_hangs", launchers=LAUNCHERS),
    *killed_and_stopped(_plant, "plant_killed", "plant_hangs", launchers=LAUNCHERS),
    Fault(estop_killed, launchers=LAUNCHERS),
    Fault(estop_hangs, launchers=LAUNCHERS),
    *killed_and_stopped(_recorder, "recorder_killed", "recorder_stopped", launchers=LAUNCHERS),
    Fault(recorder_hangs, launchers=LAUNCHERS),
    Fault(disk_full, launchers=LAUNCHERS),
    # The robot goes on to the last goal, and another goal node follows.
    *killed_and_stopped(
        partial(helper_lost, name="goals"), "goals_killed", "goals_hang",
        about=FaultEnvironment(by_goal_node=True), launchers=LAUNCHERS,
    ),
    # Control goes on, and another node draws.
    *killed_and_stopped(
        partial(helper_lost, name="markers"), "markers_killed", "markers_hang",
        about=FaultEnvironment(drawn=True), launchers=LAUNCHERS,
    ),
    *killed_and_stopped(
        partial(helper_lost, name="camera"), "camera_killed", "camera_hangs",
        about=FaultEnvironment(filmed=True), why_not=_without_camera, launchers=LAUNCHERS,
    ),
    *killed_and_stopped(
        _estimator, "estimator_killed", "estimator_hangs",
        about=FaultEnvironment(estimated=True), launchers=LAUNCHERS,
    ),
    Fault(mocap_lost, FaultEnvironment(estimated=True, intercepted=MOCAP)),
)  # fmt: skip
