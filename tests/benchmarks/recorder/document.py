"""The four questions to a recorder, answered one after another."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fulmar_bringup.run_plan import RunPlan
from fulmar_core.config.provenance import fulmar_version, git_revision
from tests.benchmarks.recorder.cost import cost_of_recording
from tests.benchmarks.recorder.loss import killed, lost_in_lock_step, lost_in_real_time

ROBOT = "floating_platform"
PARTS = ("cost", "loss", "lockstep", "kills")


@dataclass(frozen=True)
class Asked:
    """How long and how often."""

    parts: tuple[str, ...]
    stretches: int  # of the cost, with a recorder and without one
    stretch_s: float  # [s]
    loss_s: float  # of traffic in real time [s]
    lockstep_hz: float  # [Hz]
    lockstep_s: float  # simulated [s]
    kills: int
    out: Path  # folder of the bags


def measure(asked: Asked, progress: Callable[[str], None]) -> dict[str, Any]:
    """Measure what is asked for.

    Args:
        asked: What.
        progress: Called with a few words on what goes on.

    Returns:
        Figures by part, ready for JSON; `passed` where every part is.
    """
    plan = RunPlan(ROBOT, "go_to_pose", "lqr", "mujoco", control_hz=50.0)
    asked.out.mkdir(parents=True)
    found: dict[str, Any] = {}
    for part in asked.parts:
        progress(part)
        if part == "cost":
            found[part] = cost_of_recording(
                plan,
                stretches=asked.stretches,
                stretch_s=asked.stretch_s,
                out=asked.out,
                progress=lambda: progress("cost"),
            )
        elif part == "loss":
            found[part] = lost_in_real_time(
                plan,
                seconds=asked.loss_s,
                out=asked.out,
                progress=lambda seconds: progress(f"loss: {seconds:.0f} of {asked.loss_s:.0f} s"),
            )
        elif part == "lockstep":
            found[part] = lost_in_lock_step(
                ROBOT, control_hz=asked.lockstep_hz, simulated_s=asked.lockstep_s, out=asked.out
            )
        else:
            found[part] = killed(plan, kills=asked.kills, out=asked.out, progress=lambda: progress("kills"))
    return {
        **found,
        "passed": all(figures["passed"] for figures in found.values()),
        "cores": os.cpu_count(),
        "load_1_min": os.getloadavg()[0],
        "fulmar_version": fulmar_version(),
        "git_revision": git_revision(),
    }
