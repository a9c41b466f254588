"""Closed loops through emulated devices: driver, protocol, controller, recorder and safety, in real time.

Each episode is the very command that a person types, `fulmar run --backend hardware --emulate`, in a ROS domain of its
own. A real protocol has no faster clock, so that many systems run beside each other instead.
"""

from __future__ import annotations

import json
import os
import queue
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from fulmar_bringup.domains import reserved_domains
from fulmar_core.errors import UnknownNameError
from fulmar_core.tasks import load_task
from hardware_drivers.settings import load_hardware

REQUIRED = 0.95  # share of episodes that reach their goal
SLACK_S = 120.0  # what starting and stopping may take on a busy machine
FIRST_SEED = 1


@dataclass(frozen=True)
class Case:
    """A device and what it is asked to do."""

    hardware: str  # name of a file in configs/hardware
    task: str

    @property
    def robot(self) -> str:
        """Whose device it is."""
        return load_hardware(self.hardware).robot


CASES = (
    Case("zero_g_lab", "go_to_pose"),
    Case("turtlebot2", "go_to_position"),
    Case("kingfisher", "go_to_position"),
    Case("kingfisher_ardupilot", "go_to_position"),
)


@dataclass(frozen=True)
class Episode:
    """How one of them went."""

    seed: int
    success: bool
    failure: str | None  # why it did not come to its end
    final_position_error_m: float | None
    watchdog_trips: int | None
    latency_p99_ms: float | None


def cases_of(robots: Iterable[str] | None) -> list[Case]:
    """The cases of some robots, or all.

    Raises:
        UnknownNameError: A robot has none.
    """
    if robots is None:
        return list(CASES)
    known = {case.robot for case in CASES}
    for robot in robots:
        if robot not in known:
            raise UnknownNameError("emulated robot", robot, known)
    return [case for case in CASES if case.robot in set(robots)]


def measure(
    cases: list[Case], *, episodes: int, jobs: int, progress: Callable[[int], None]
) -> list[dict[str, Any]]:
    """Run every episode of every case.

    Args:
        cases: What to run.
        episodes: Of each case.
        jobs: Systems beside each other.
        progress: Told how many episodes are over.

    Returns:
        Figures of each case, ready for JSON.

    Raises:
        ConfigError: There are not so many free ROS domains.
    """
    done: dict[Case, list[Episode]] = {case: [] for case in cases}
    with reserved_domains(jobs) as domains, ThreadPoolExecutor(jobs) as pool:
        free: queue.SimpleQueue[int] = queue.SimpleQueue()
        for domain in domains:
            free.put(domain)
        seeds = range(FIRST_SEED, FIRST_SEED + episodes)
        asked = {pool.submit(_run, case, seed, free): case for case in cases for seed in seeds}
        try:
            for count, future in enumerate(as_completed(asked), 1):
                done[asked[future]].append(future.result())
                progress(count)
        finally:
            pool.shutdown(cancel_futures=True)
    return [_figures(case, sorted(found, key=lambda episode: episode.seed)) for case, found in done.items()]


def _run(case: Case, seed: int, free: queue.SimpleQueue[int]) -> Episode:
    domain = free.get()
    try:
        with tempfile.TemporaryDirectory(prefix="fulmar_", ignore_cleanup_errors=True) as folder:
            return _episode(seed, *_output(case, seed, domain, Path(folder) / "bag"))
    finally:
        free.put(domain)


def _output(case: Case, seed: int, domain: int, record: Path) -> tuple[str, str]:
    """What the command prints: its JSON object, and what it says besides."""
    command = [sys.executable, "-m", "fulmar_bringup.cli", "run", case.robot, "--task", case.task]
    command += ["--backend", "hardware", "--hardware", case.hardware, "--emulate", "--seed", str(seed)]
    try:
        done = subprocess.run(
            [*command, "--record", str(record), "--json"],
            env={**os.environ, "ROS_DOMAIN_ID": str(domain)},
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=load_task(case.task).episode_s + SLACK_S,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return "", "it did not end in time"
    return done.stdout, done.stderr


def _episode(seed: int, out: str, err: str) -> Episode:
    try:
        summary = json.loads(out)
    except ValueError:
        last = err.strip().splitlines()[-1:] or ["it said nothing"]
        return Episode(seed, False, last[0], None, None, None)
    return Episode(
        seed,
        bool(summary["success"]) and not summary["failure"],
        summary["failure"],
        summary["final_position_error_m"],
        summary["watchdog_trips"],
        summary["latency_ms"]["p99"],
    )


def _figures(case: Case, episodes: list[Episode]) -> dict[str, Any]:
    succeeded = sum(episode.success for episode in episodes)
    share = succeeded / len(episodes)
    return {
        **asdict(case),
        "robot": case.robot,
        "driver": load_hardware(case.hardware).driver.kind,
        "episodes": len(episodes),
        "succeeded": succeeded,
        "share": share,
        "required": REQUIRED,
        "passed": share >= REQUIRED,
        "watchdog_trips": sum(episode.watchdog_trips or 0 for episode in episodes),
        "missed": [asdict(episode) for episode in episodes if not episode.success],
    }
