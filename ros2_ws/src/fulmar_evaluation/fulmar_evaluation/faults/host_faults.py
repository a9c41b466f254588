"""Faults of a launcher and of the computer below a node: stopped, killed, without memory, with a clock that steps."""

from __future__ import annotations

import math
import signal
import time

import psutil
from rcl_interfaces.srv import GetParameters

from fulmar_core.robots.robot import Robot
from fulmar_evaluation.faults import stepped_clock, two_hosts
from fulmar_evaluation.faults.endurance import complaint, resting
from fulmar_evaluation.faults.fault import STAYS_S, WORDS_S, Fault, Outcome, went_on
from fulmar_evaluation.faults.fault_environment import FaultEnvironment
from fulmar_evaluation.faults.flight_watch import FLIES_S
from fulmar_evaluation.faults.launched import LAUNCHERS
from fulmar_evaluation.faults.live_system import LiveSystem
from fulmar_evaluation.faults.observer import wait_for

NOTICED_S = 8.0  # until nodes say that their launcher hangs
ENDED_S = 10.0  # for nodes to end with their launcher
OWN_LANDING_S = 60.0  # for a plant without a launcher to fly a craft down from a metre
REQUEST_BYTES = 64 * 2**20  # more than a node without memory can take
MATCH_S = 10.0
CLOCK_S = 10.0  # by which a clock steps, forwards and then back
STEPPED_S = 5.0  # for which it is watched after each step


def supervisor_stopped(live: LiveSystem) -> Outcome:
    """SIGSTOP of `fulmar run` or `fulmar up`: control goes on, and the nodes say that nobody watches over them."""
    since_s = live.until_it_moves()
    live.launched.process.send_signal(signal.SIGSTOP)
    try:
        wait_for(lambda: complaint(live, since_s, _of_launcher) is not None, NOTICED_S)
        status = complaint(live, since_s, _of_launcher)
        words = f"{status.text}; control goes on" if status else "nobody noticed that the launcher hangs"
        who = status.who if status else ""
        return went_on(live, since_s, detected_by=who, reaction=words, correct=status is not None)
    finally:
        live.signal_launcher(signal.SIGCONT)


def _of_launcher(words: str) -> bool:
    return "launcher" in words


def supervisor_killed(live: LiveSystem) -> Outcome:
    """SIGKILL of `fulmar run` or `fulmar up`: every node ends with it, in order, and the robot is safe."""
    since_s = live.until_it_moves()
    nodes = list(live.launched.nodes().values())
    live.launched.process.kill()
    killed_s = time.monotonic()
    limit_s = ENDED_S if live.flight is None else OWN_LANDING_S
    wait_for(lambda: not any(map(_lives, nodes)), limit_s)
    left = sum(map(_lives, nodes))
    applied = live.observer.applied_since(since_s)
    safe_s = next((s for s, moves in reversed(applied) if moves), since_s) - since_s
    ends_safe = bool(applied) and not applied[-1][1]
    words = f"{left} of {len(nodes)} nodes are left over" if left else "every node ended with its launcher"
    if live.flight is not None:
        flown, level = live.flight.since(since_s)
        words, ends_safe = f"{words}; {flown}", level
    # The recorder of an aircraft ends before its plant, which flies it down.
    away = (killed_s, math.inf) if live.flight is not None else None
    return Outcome("nodes" if not left else "", words, ends_safe and not left, safe_s, limit_s, away)


def _lives(process: psutil.Process) -> bool:
    try:
        return process.is_running() and process.status() != psutil.STATUS_ZOMBIE
    except psutil.Error:
        return False


def out_of_memory(live: LiveSystem) -> Outcome:
    """The controller gets no more memory than it has, and a request of 64 MB comes: it goes on, or ends in words."""
    with live.stranger() as node:
        # Of its parameters, which no other node reads and no recorder records.
        client = node.create_client(GetParameters, "controller/get_parameters")
        client.wait_for_service(MATCH_S)
        controller, request = live.process("controller"), GetParameters.Request(names=["x" * REQUEST_BYTES])
        since_s = live.until_it_moves()
        controller.rlimit(psutil.RLIMIT_AS, (controller.memory_info().vms, psutil.RLIM_INFINITY))
        client.call_async(request)
        return _safe_or_on(live, since_s, live.silenced_s)


def _safe_or_on(live: LiveSystem, since_s: float, limit_s: float) -> Outcome:
    """The robot is safe within a time of the last command and somebody says why, or it goes on without a pause."""
    time.sleep(limit_s + WORDS_S + STAYS_S)
    rests, safe_s = resting(live, since_s)
    if not rests and live.flight is None:
        return went_on(live, since_s, detected_by="", reaction="control goes on", correct=True)
    status = live.observer.problem_since(since_s)
    if status is None:
        return went_on(live, since_s, detected_by="", reaction="control goes on", correct=True)
    passed, words = safe_s is not None or live.flight is not None, status.text
    if live.flight is not None:
        time.sleep(FLIES_S)
        flown, passed = live.flight.since(since_s)
        words = f"{words}; {flown}"
    return Outcome(status.who, words, passed, safe_s, limit_s + WORDS_S)


def clock_steps(live: LiveSystem) -> Outcome:
    """The clock of the controller's computer steps by 10 s, and back: nothing in the loop depends on it."""
    since_s = live.until_it_moves()
    for by_s in (CLOCK_S, 0.0):
        live.clock.step(by_s)
        time.sleep(STEPPED_S)
    reaction = f"driven for {2.0 * STEPPED_S:g} s without a pause"
    return went_on(live, since_s, detected_by="", reaction=reaction, correct=True)


def _without_stepping(_robot: Robot) -> str:
    return two_hosts.why_not() or stepped_clock.why_not()


HOST_FAULTS = (
    Fault(supervisor_stopped, launchers=LAUNCHERS),
    Fault(supervisor_killed, launchers=LAUNCHERS),
    Fault(out_of_memory, launchers=LAUNCHERS),
    Fault(clock_steps, FaultEnvironment(two_hosts=True, clock_of="controller"), _without_stepping),
)
