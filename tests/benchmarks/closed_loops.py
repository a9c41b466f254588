"""Campaigns of whole runs in real time: each episode is a command that a person could type.

Nothing in them has a faster clock, so that several run beside each other instead, each in a ROS domain of its own. An
episode that came to its end is kept as a file, so that a campaign that was broken off goes on where it was.
"""

from __future__ import annotations

import contextlib
import json
import os
import queue
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Protocol

from fulmar_bringup.domains import reserved_domains
from fulmar_core.config.atomic_write import write_whole

REQUIRED = 0.95  # share of episodes that reach their goal
SLACK_S = 120.0  # what starting and stopping may take on a busy machine
FIRST_SEED = 1


@dataclass(frozen=True)
class Command:
    """How one episode is started: `fulmar run` with what comes before and after it."""

    before: Sequence[str]
    after: Sequence[str]
    environment: Mapping[str, str]


class Case(Protocol):
    """What is run again and again."""

    @property
    def name(self) -> str:
        """Of the files in which its episodes are kept."""

    @property
    def robot(self) -> str:
        """Which robot."""

    @property
    def task(self) -> str:
        """What it is to do."""

    def prepared(self, seed: int) -> contextlib.AbstractContextManager[Command]:
        """What an episode needs around it."""

    def about(self) -> dict[str, Any]:
        """What is reported about it beside its figures."""


@dataclass(frozen=True)
class Episode:
    """How one of them went."""

    seed: int
    success: bool
    failure: str | None  # why it did not come to its end
    final_position_error_m: float | None
    watchdog_trips: int | None
    latency_p99_ms: float | None


@dataclass(frozen=True)
class Campaign:
    """How episodes are run, and where they are kept."""

    episodes: int  # of each case
    seconds: float | None  # of each episode, at whose end the goal is held; None: the task's own [s]
    jobs: int  # systems beside each other
    out: Path | None = None  # folder of what came of each; None: nothing is kept

    def seconds_of(self, case: Case) -> float:
        """Length of a case's episodes [s]."""
        from fulmar_core.tasks import load_task  # here, so that `fulmar --help` needs no NumPy

        return self.seconds or load_task(case.task).episode_s


def measure(
    cases: Sequence[Case], campaign: Campaign, progress: Callable[[int], None]
) -> list[dict[str, Any]]:
    """Run every episode of every case that is not kept already.

    Args:
        cases: What to run.
        campaign: How.
        progress: Called with how many episodes are over.

    Returns:
        Figures of each case, ready for JSON.

    Raises:
        ConfigError: There are not so many free ROS domains.
    """
    done: dict[Case, list[Episode]] = {case: [] for case in cases}
    with reserved_domains(campaign.jobs) as domains, ThreadPoolExecutor(campaign.jobs) as pool:
        free: queue.SimpleQueue[int] = queue.SimpleQueue()
        for domain in domains:
            free.put(domain)
        seeds = range(FIRST_SEED, FIRST_SEED + campaign.episodes)
        # Seed by seed, so that what is broken off has some of each.
        asked = {pool.submit(_run, case, seed, campaign, free): case for seed in seeds for case in cases}
        try:
            for count, future in enumerate(as_completed(asked), 1):
                done[asked[future]].append(future.result())
                progress(count)
        finally:
            pool.shutdown(cancel_futures=True)
    return [
        _figures(case, campaign, sorted(found, key=lambda episode: episode.seed))
        for case, found in done.items()
    ]


def _run(case: Case, seed: int, campaign: Campaign, free: queue.SimpleQueue[int]) -> Episode:
    seconds = campaign.seconds_of(case)
    kept = campaign.out / f"{case.name}_{seconds:g}s_{seed}.json" if campaign.out else None
    if kept is not None and kept.exists():
        return Episode(**json.loads(kept.read_text(encoding="utf-8")))
    domain = free.get()
    try:
        with tempfile.TemporaryDirectory(prefix="fulmar_", ignore_cleanup_errors=True) as folder:
            episode = _episode(seed, *_output(case, seed, seconds, domain, Path(folder) / "bag"))
    finally:
        free.put(domain)
    if kept is not None:
        kept.parent.mkdir(parents=True, exist_ok=True)
        write_whole({kept: json.dumps(asdict(episode)).encode()})
    return episode


def _output(case: Case, seed: int, seconds: float, domain: int, record: Path) -> tuple[str, str]:
    """What the command prints: its JSON object; and what is to be said where that is missing."""
    run = [sys.executable, "-m", "fulmar_cli.main", "run", case.robot, "--task", case.task]
    run += ["--seed", str(seed), "--duration", str(seconds), "--record", str(record), "--json"]
    with case.prepared(seed) as command:
        try:
            done = subprocess.run(
                [*command.before, *run, *command.after],
                env={**os.environ, **command.environment, "ROS_DOMAIN_ID": str(domain)},
                stdin=subprocess.DEVNULL,
                capture_output=True,
                text=True,
                timeout=seconds + SLACK_S,
                check=False,
            )
        except subprocess.TimeoutExpired:
            return "", "it did not end in time"
    ended = f"it ended with {done.returncode}, and last said: "
    said = done.stderr.strip().splitlines() or ["nothing"]
    return done.stdout, ended + next((line for line in reversed(said) if _states(line)), said[-1])


def _states(line: str) -> bool:
    """Whether a line may say what went wrong: those of a process that ended in good order do not."""
    return not line.startswith("[recorder] record")


def _episode(seed: int, out: str, problem: str) -> Episode:
    try:
        summary = json.loads(out)
    except ValueError:
        return Episode(seed, False, problem, None, None, None)
    return Episode(
        seed,
        bool(summary["success"]) and not summary["failure"],
        summary["failure"],
        summary["final_position_error_m"],
        summary["watchdog_trips"],
        summary["latency_ms"]["p99"],
    )


def _figures(case: Case, campaign: Campaign, episodes: list[Episode]) -> dict[str, Any]:
    succeeded = sum(episode.success for episode in episodes)
    share = succeeded / len(episodes)
    return {
        **case.about(),
        "robot": case.robot,
        "task": case.task,
        "episodes": len(episodes),
        "seconds": campaign.seconds_of(case),
        "succeeded": succeeded,
        "share": share,
        "required": REQUIRED,
        "passed": share >= REQUIRED,
        "watchdog_trips": sum(episode.watchdog_trips or 0 for episode in episodes),
        "missed": [asdict(episode) for episode in episodes if not episode.success],
    }
