"""Counts of episodes, worlds and processes that no machine can do are rejected before anything starts."""

from __future__ import annotations

import sys
from pathlib import Path

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot import Robot

MOST = 10_000_000  # of anything that is counted: at 10,000 episodes a second this is a quarter of an hour
WORLD_BYTES = 12_000  # of a world and what one step of it computes, measured with the floating platform
PROCESS_BYTES = 85_000_000  # of a process that evaluates, measured before its first episode
# A record keeps ten float32 figures and two truth values of a step, and a share for each actuator; joining and
# evaluating it takes 3.4 times as much memory (measured).
STEP_BYTES, SHARE_BYTES, RECORD_COPIES = 42, 4, 3.5
MEMINFO, CGROUP = Path("/proc/meminfo"), Path("/sys/fs/cgroup")


def check_count(option: str, count: int, *, bytes_each: float = 0.0, free: int | None = None) -> None:
    """Reject a count beyond `MOST`, or one that needs more memory than is free.

    Args:
        option: Name of the option, for the message.
        count: What was asked for.
        bytes_each: Memory that each one takes [bytes].
        free: Memory that is free; that of this machine by default [bytes].

    Raises:
        ConfigError: With the limit.
    """
    if count > MOST:
        raise ConfigError(f"{option} = {count:,} is too many: at most {MOST:,}.")
    free = free_memory() if free is None else free
    if count * bytes_each > free:
        raise ConfigError(
            f"{option} = {count:,} needs about {count * bytes_each / 1e9:,.1f} GB of memory, {free / 1e9:.1f} GB are "
            f"free: at most {int(free / bytes_each):,}."
        )


def check_episodes(
    robot: Robot, *, episodes: int, steps: int, worlds: int | None = None, jobs: int = 1, at_once: int = 1
) -> None:
    """Reject episodes that cannot be evaluated here.

    Args:
        robot: The robot that they are of.
        episodes: `--episodes`.
        steps: Control steps of one of them.
        worlds: `--worlds`: how many are in memory at once; all of them by default.
        jobs: `--jobs`.
        at_once: Processes that each hold all episodes, or worlds, at the same time.

    Raises:
        ConfigError: With the limit.
    """
    check_count("--episodes", episodes)
    check_count("--steps", steps)
    check_count("--jobs", jobs, bytes_each=PROCESS_BYTES)
    record = steps * (STEP_BYTES + SHARE_BYTES * len(robot.actuators.scale))
    each = at_once * (WORLD_BYTES + RECORD_COPIES * record)
    if worlds is None:
        check_count("--episodes", episodes, bytes_each=each)
    else:
        check_count("--worlds", min(worlds, episodes), bytes_each=each)


def free_memory(meminfo: Path = MEMINFO, cgroup: Path = CGROUP) -> int:
    """Memory that this process may still take [bytes]; without bound where the system does not report it.

    Args:
        meminfo: Linux's report on the computer.
        cgroup: Linux's report on the container or unit that this process runs in.
    """
    try:
        lines = dict(line.split(":", 1) for line in meminfo.read_text().splitlines())
        free = 1024 * int(lines["MemAvailable"].split()[0])
    except (OSError, KeyError, ValueError):
        return sys.maxsize
    try:
        most = (cgroup / "memory.max").read_text().strip()
        used = int((cgroup / "memory.current").read_text())
        about = dict(line.split() for line in (cgroup / "memory.stat").read_text().splitlines())
        used -= int(about["inactive_file"])  # a cache of files, which the kernel gives back
    except (OSError, KeyError, ValueError):  # no container, or one without a limit of its own
        return free
    return free if most == "max" else min(free, max(int(most) - used, 0))
