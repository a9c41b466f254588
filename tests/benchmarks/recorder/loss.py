"""Minutes of traffic in real time: is every message in the bag?"""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from fulmar_bringup.domains import own_domain
from fulmar_bringup.run_plan import RunPlan
from fulmar_core.topics import COMMAND, ODOMETRY
from tests.benchmarks.recorder.bag_stamps import stamps_by_topic
from tests.benchmarks.recorder.recorders import recorders
from tests.benchmarks.recorder.traffic import EVERY, traffic

LAST_S = 0.5  # for the last messages to arrive


def lost_in_real_time(
    plan: RunPlan,
    *,
    seconds: float,
    out: Path,
    progress: Callable[[float], None],
) -> dict[str, Any]:
    """Record traffic.

    Args:
        plan: Whose wires.
        seconds: How long.
        out: Folder of the bag.
        progress: Told how long it has gone on [s].

    Returns:
        Figures by name, ready for JSON.
    """
    bag = out / "real_time"
    with (
        own_domain(),
        traffic(plan) as source,
        recorders({bag: plan}) as (recorder,),
    ):
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
