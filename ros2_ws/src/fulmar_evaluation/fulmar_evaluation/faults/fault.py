"""A fault, and the result of doing it to a live system."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

from fulmar_core.robots.robot import Robot
from fulmar_evaluation.faults.by_kind import FAULTS
from fulmar_evaluation.faults.fault_environment import USUAL, FaultEnvironment
from fulmar_evaluation.faults.flight_watch import FLIES_S
from fulmar_evaluation.faults.launched import RUN
from fulmar_evaluation.faults.live_system import LiveSystem, NothingShown
from fulmar_evaluation.faults.observer import wait_for

WORDS_S = 2.0  # a node says what is wrong within a second, on a machine that has time for it
STAYS_S = 1.0  # what is safe must stay so


@dataclass(frozen=True)
class Outcome:
    """What a system made of a fault."""

    detected_by: str  # the node that said first what is wrong; empty if nobody did
    reaction: str  # in its own words
    passed: bool
    # From the fault to the last moment at which anything moved; None: it went on [s].
    time_to_safe_s: float | None = None
    limit_s: float | None = None  # None: the robot is to go on [s]
    recorder_away: tuple[float, float] | None = None  # from when to when the fault kept it from its work [s]
    recorder_again: bool = False  # it died, and was started again


@dataclass(frozen=True)
class FaultResult:
    """One line of the report."""

    name: str
    detected_by: str  # as in `Outcome`
    reaction: str
    time_to_safe_s: float | None
    limit_s: float | None
    data_lost: int | None  # messages that came and are not in the bag; None: the fault could not be done
    bag_intact: bool | None  # it opens, and has no gap while its recorder could work; None: same
    passed: bool
    launcher: str = RUN  # the command that had started the system: run or up
    launcher_ended: str = ""  # why the launcher ended by itself; empty if it did not

    @property
    def status(self) -> str:
        """For people."""
        return "not done" if self.bag_intact is None else "passed" if self.passed else "FAILED"


def stopped(live: LiveSystem, since_s: float, limit_s: float) -> Outcome:
    """Whether a robot that moved got safe in time, stayed so, and somebody said why.

    What cannot stop is safe once its safe controller flies it, with level wings.

    Args:
        live: The system.
        since_s: When the fault was done, on the monotonic clock [s].
        limit_s: The longest time to the safe state [s].

    Raises:
        NothingShown: Nothing moved any more when the fault was done.
    """
    observer = live.observer
    wait_for(lambda: time.monotonic() > since_s + limit_s + STAYS_S, limit_s + 2.0 * STAYS_S)
    applied = observer.applied_since(since_s)
    unsafe = [received_s for received_s, moves in applied if moves]
    if not unsafe:
        raise NothingShown("nothing moved when the fault was done, so it shows nothing")
    safe = [received_s for received_s, moves in applied if not moves and received_s > unsafe[-1]]
    time_s = safe[0] - since_s if safe else None
    wait_for(lambda: observer.problem_since(since_s) is not None, WORDS_S)
    status = observer.problem_since(since_s)
    passed = time_s is not None and time_s <= limit_s and status is not None
    words = status.text if status else ""
    if live.flight is not None:
        wait_for(lambda: time.monotonic() > since_s + limit_s + FLIES_S, limit_s + 2.0 * FLIES_S)
        flown, level = live.flight.since(since_s)
        words, passed = "; ".join(text for text in (words, flown) if text), passed and level
    return Outcome(status.who if status else "", words, passed, time_s, limit_s)


def braked(live: LiveSystem, since_s: float, limit_s: float) -> Outcome:
    """Whether the controller of a robot that floats said in time why it acts no more: its backup brakes from then on.

    Arguments as in `stopped`. Valves that brake move, so the applied commands do not show whether the robot is safe.
    """
    observer = live.observer
    wait_for(lambda: observer.problem_since(since_s) is not None, limit_s + WORDS_S)
    status = observer.problem_since(since_s)
    time_s = None if status is None else status.received_s - since_s
    passed = time_s is not None and time_s <= limit_s
    return Outcome(status.who if status else "", status.text if status else "", passed, time_s, limit_s)


def went_on(
    live: LiveSystem,
    since_s: float,
    *,
    detected_by: str,
    reaction: str,
    correct: bool,
    recorder_away: tuple[float, float] | None = None,
    recorder_again: bool = False,
) -> Outcome:
    """Whether a robot went on, without a pause as long as its watchdog, and the right thing was said.

    Args:
        live: The system.
        since_s: When the fault was done, some time ago [s].
        detected_by: Who said it; empty if nobody did.
        reaction: What was said.
        correct: Whether that is what had to be said.
        recorder_away: As in `Outcome`.
        recorder_again: Same.
    """
    statuses = live.observer.statuses_since(since_s - WORDS_S)  # with one from before, to compare with
    trips = {status.values.get("watchdog_trips", "") for status in statuses if status.who == "plant"}
    moved = any(moves for _, moves in live.observer.applied_since(since_s))
    wrong = [] if moved else ["the robot stood still"]
    wrong += [f"{live.launcher} ended: {live.failure}"] if live.has_ended else []
    wrong += (
        []
        if len(trips) == 1
        else [f"the watchdog tripped (trips reported: {', '.join(sorted(trips)) or 'none'})"]
    )
    said = "; ".join([*wrong, reaction])
    return Outcome(
        detected_by, said, correct and not wrong, recorder_away=recorder_away, recorder_again=recorder_again
    )


def possible(_robot: Robot) -> str:
    """Every robot and every machine can have it."""
    return ""


@dataclass(frozen=True)
class Fault:
    """One line of the suite's table."""

    do: Callable[[LiveSystem], Outcome]
    about: FaultEnvironment = USUAL
    # Why a robot, or this machine, cannot have it; empty if it can.
    why_not: Callable[[Robot], str] = possible
    begins: bool = True  # whether the system is under way when it is done
    launchers: tuple[str, ...] = (RUN,)  # under which it is done; both where they differ
    called: str = ""  # where it is not the name of `do`

    def inapplicable(self, robot: Robot) -> str:
        """Why a robot, or this machine, cannot have it, by the system that it is done to too; empty if it can."""
        excused = FAULTS[robot.kind.name].excused.get(self.name, "")
        return excused or self.why_not(robot) or self.about.why_not(robot)

    @property
    def name(self) -> str:
        """What people call it."""
        return self.called or self.do.__name__


def killed_and_stopped(
    do: Callable[..., Outcome], killed: str, stopped: str, **more: Any
) -> tuple[Fault, Fault]:
    """Two faults that send SIGKILL or SIGSTOP to a process, by their names; `more` as in `Fault`."""
    return (
        Fault(partial(do, number=signal.SIGKILL), called=killed, **more),
        Fault(partial(do, number=signal.SIGSTOP), called=stopped, **more),
    )
