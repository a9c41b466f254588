"""A run in lock step, much faster than real time: is every message of every step in the bag?"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from fulmar_bags.run_record import read_run
from fulmar_bringup.domains import own_domain
from fulmar_bringup.planning import plan_run
from fulmar_core.errors import RunFailed
from fulmar_core.topics import (
    ACTION,
    ACTUATORS_STATE,
    COMMAND,
    OBSERVATION,
    ODOMETRY,
    SIMULATION_START_NS,
    TRUTH,
)
from fulmar_evaluation.run_outcome import run_and_evaluate
from tests.benchmarks.recorder.bag_stamps import stamps_by_topic

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
    request = plan_run(
        robot=robot,
        task="go_to_pose",
        controller="lqr",
        backend="mujoco",
        policy=None,
        goal=(0.0, 0.0, 0.0),
        start=(3.0, 1.0, 90.0),
        duration_s=simulated_s,
        lockstep=True,
        rate=1.0,
        control_hz=control_hz,
        scenario="nominal",
        seed=1,
        record=out / "lock_step",
        command="fulmar benchmark recorder",
    )
    with own_domain():
        failure = run_and_evaluate(request).failure
    log_s = read_run(request.record).odom.log_s if request.record.exists() else np.empty(0)
    if len(log_s) < 2:
        raise RunFailed(f"nothing was recorded: {failure or 'the run said nothing'}.")
    period_ns, steps = round(1e9 / control_hz), round(simulated_s * control_hz)
    expected = {SIMULATION_START_NS + step * period_ns for step in range(steps)}
    stamps = stamps_by_topic(request.record)
    lost = {wire.name: len(expected - set(stamps[f"{request.plan.namespace}/{wire.name}"])) for wire in WIRES}
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
