"""Messages missing from bags: in real time, in lock step, and after SIGKILL at random moments."""

from __future__ import annotations

import random
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from fulmar_bags.run_record import read_run
from fulmar_bringup.completion import completed
from fulmar_bringup.domains import own_domain
from fulmar_bringup.plan_checks import checked
from fulmar_bringup.run_plan import RunPlan
from fulmar_core.config.errors import RunFailed
from fulmar_core.config.recording import Recording
from fulmar_core.robots.topics import (
    ACTION,
    ACTUATORS_STATE,
    COMMAND,
    OBSERVATION,
    ODOMETRY,
    SIMULATION_START_NS,
    TRUTH,
)
from fulmar_evaluation.run_outcome import run_and_evaluate
from tests.benchmarks.recorder.recorders import EVERY, Traffic, opens, recorders, stamps_by_topic, traffic

LAST_S = 0.5  # for the last messages to arrive


def lost_in_real_time(
    plan: RunPlan, *, seconds: float, out: Path, progress: Callable[[float], None]
) -> dict[str, Any]:
    """Record traffic.

    Args:
        plan: Whose wires.
        seconds: How long.
        out: Folder of the bag.
        progress: Called with how long it has gone on [s].

    Returns:
        Figures by name, ready for JSON.
    """
    bag = out / "real_time"
    with own_domain(), traffic(plan) as source, recorders({bag: plan}) as (recorder,):
        source.wait_for(1)
        source.start()
        began = time.monotonic()
        while time.monotonic() - began < seconds:
            time.sleep(min(0.2, seconds))
            progress(time.monotonic() - began)
        cpu = recorder.process.cpu_times()
        source.stop()
        took_s = time.monotonic() - began
        time.sleep(LAST_S)
        exit_code = recorder.stop()
    stamps = stamps_by_topic(bag)
    odometry = set(range(len(source.sent_s)))
    commands = set(range(0, len(source.sent_s), EVERY))
    lost = {
        ODOMETRY.name: len(odometry - set(stamps[f"{plan.namespace}/{ODOMETRY.name}"])),
        COMMAND.name: len(commands - set(stamps[f"{plan.namespace}/{COMMAND.name}"])),
    }
    return {
        "seconds": took_s,
        "odometry_hz": len(odometry) / took_s,
        "command_hz": len(commands) / took_s,
        "sent": len(odometry) + len(commands),
        "lost": lost,
        "cpu_share": (cpu.user + cpu.system) / took_s,
        "recorder_exit_code": exit_code,
        "passed": not any(lost.values()) and exit_code == 0,
    }


WIRES = (ODOMETRY, TRUTH, COMMAND, ACTUATORS_STATE, OBSERVATION, ACTION)
WANTED_RATE = 20.0  # simulated seconds a second


def lost_in_lock_step(robot: str, *, control_hz: float, simulated_s: float, out: Path) -> dict[str, Any]:
    """Run LQR in lock step.

    Args:
        robot: With thrusters.
        control_hz: Steps a simulated second [Hz].
        simulated_s: Length of the run [s].
        out: Folder of the bag.

    Returns:
        Figures by name, ready for JSON.

    Raises:
        RunFailed: The run did not begin.
    """
    plan = RunPlan(
        robot,
        "go_to_pose",
        "lqr",
        "mujoco",
        control_hz,
        goal=(0.0, 0.0, 0.0),
        start=(3.0, 1.0, 90.0),
        duration_s=simulated_s,
        lockstep=True,
        seed=1,
        record=str(out / "lock_step"),
        command="fulmar benchmark recorder",
    )
    record = Path(plan.record)
    with own_domain():
        failure = run_and_evaluate(checked(completed(plan))).failure
    log_s = read_run(record).odom.log_s if record.exists() else np.empty(0)
    if len(log_s) < 2:
        raise RunFailed(f"nothing was recorded: {failure or 'the run said nothing'}.")
    period_ns, steps = round(1e9 / control_hz), round(simulated_s * control_hz)
    expected = {SIMULATION_START_NS + step * period_ns for step in range(steps)}
    stamps = stamps_by_topic(record)
    lost = {wire.name: len(expected - set(stamps[f"{plan.namespace}/{wire.name}"])) for wire in WIRES}
    rate = simulated_s / float(log_s[-1] - log_s[0])
    return {
        "simulated_s": simulated_s,
        "control_hz": control_hz,
        "times_real_time": rate,
        "sent": steps * len(WIRES),
        "lost": lost,
        "failure": failure or None,
        "passed": not any(lost.values()) and not failure and rate >= WANTED_RATE,
    }


AT_ONCE = 5  # recorders that receive the same traffic and die one after another
LONGEST_S = 10.0  # a recorder lives up to this long [s]
SHORT_FILES = Recording(split_s=1.0)  # every other recorder, so that some die while they change files


def killed(plan: RunPlan, *, kills: int, out: Path, progress: Callable[[], None]) -> dict[str, Any]:
    """Kill recorders.

    Args:
        plan: Whose wires.
        kills: How many, >= 1.
        out: Folder of the bags.
        progress: Called after each.

    Returns:
        Figures by name, ready for JSON.
    """
    draw = random.Random(1)
    missing_s: list[float] = []
    opened = torn = 0
    while len(missing_s) < kills:
        count = min(AT_ONCE, kills - len(missing_s))
        first = len(missing_s)
        plans = {
            out / f"killed_{first + i}": replace(plan, recording=SHORT_FILES) if i % 2 else plan
            for i in range(count)
        }
        with own_domain(), traffic(plan) as source, recorders(plans) as alive:
            source.wait_for(count)
            source.start()
            moments = sorted(draw.uniform(0.0, LONGEST_S) for _ in alive)
            began, died_s = time.monotonic(), []
            for recorder, moment in zip(alive, moments, strict=True):
                time.sleep(max(0.0, began + moment - time.monotonic()))
                recorder.kill()
                died_s.append(time.monotonic())
            source.stop()
            for recorder, moment_s in zip(alive, died_s, strict=True):
                opened += opens(recorder.bag)
                gap, lost_s = _lost(recorder.bag, plan.namespace, source, moment_s)
                torn += gap
                missing_s.append(lost_s)
                progress()
    return {
        "kills": kills,
        "opened_by_rosbags_and_mcap": opened,
        "bags_with_gaps": torn,
        "missing_at_the_end_s": {
            "median": sorted(missing_s)[len(missing_s) // 2],
            "max": max(missing_s),
            "allowed": 1.0,
        },
        "passed": opened == kills and not torn and max(missing_s) <= 1.0,
    }


def _lost(bag: Path, namespace: str, source: Traffic, died_s: float) -> tuple[bool, float]:
    """Whether anything but the end is missing, and how much of the end [s]."""
    stamps = stamps_by_topic(bag)
    odometry, commands = stamps[f"{namespace}/{ODOMETRY.name}"], stamps[f"{namespace}/{COMMAND.name}"]
    gap = odometry != list(range(len(odometry))) or commands != list(range(0, EVERY * len(commands), EVERY))
    sent = [moment for moment in source.sent_s if moment <= died_s]
    unkept = sent[len(odometry) :]
    return gap, (unkept[-1] - unkept[0] if unkept else 0.0)
