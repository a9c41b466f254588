"""SIGKILL at random moments: does every bag open, and how much is missing?"""

from __future__ import annotations

import random
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from fulmar_bringup.domains import own_domain
from fulmar_bringup.run_plan import RunPlan
from fulmar_core.recording import Recording
from fulmar_core.topics import COMMAND, ODOMETRY
from tests.benchmarks.recorder.bag_stamps import opens, stamps_by_topic
from tests.benchmarks.recorder.recorders import recorders
from tests.benchmarks.recorder.traffic import EVERY, Traffic, traffic

AT_ONCE = 5  # recorders that hear the same traffic and die one after another
LONGEST_S = 10.0  # a recorder lives up to this long [s]
SHORT_FILES = Recording(split_s=1.0)  # every other recorder, so that some die while they change files


def killed(plan: RunPlan, *, kills: int, out: Path, progress: Callable[[], None]) -> dict[str, Any]:
    """Kill recorders.

    Args:
        plan: Whose wires.
        kills: How many, >= 1.
        out: Folder of the bags.
        progress: Told of each.

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
        with (
            own_domain(),
            traffic(plan) as source,
            recorders(plans) as alive,
        ):
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
