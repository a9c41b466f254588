"""Running `fulmar` as a person does, in a process of its own."""

from __future__ import annotations

import contextlib
import json
import shutil
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import psutil
import yaml

FULMAR = [sys.executable, "-m", "fulmar_cli.main"]
WATCHDOG_TRIP = "plant: no command for"  # how a run begins to say that its watchdog tripped


def fulmar(
    *arguments: str, env: dict[str, str], cwd: Path, timeout_s: float = 90.0
) -> subprocess.CompletedProcess[str]:
    """Run a command to its end."""
    return subprocess.run(
        [*FULMAR, *arguments],
        env=env,
        cwd=cwd,
        capture_output=True,
        text=True,
        timeout=timeout_s,
        check=False,
        stdin=subprocess.DEVNULL,
    )


def run_in_real_time(*arguments: str, env: dict[str, str], cwd: Path) -> subprocess.CompletedProcess[str]:
    """Run a robot, recorded to `bag`, and once more if the watchdog tripped, as a person on a busy machine would.

    A machine that gives the controller no time for 0.4 s trips the watchdog, as it must. Every other failure stays, and
    so does a second trip.
    """
    asked = ("run", *arguments, "--record", "bag", "--json")
    done = fulmar(*asked, env=env, cwd=cwd)
    if tripped(done.stdout):
        shutil.rmtree(cwd / "bag")
        done = fulmar(*asked, env=env, cwd=cwd)
    return done


def tripped(output: str) -> bool:
    """Whether a run's JSON object says that it failed by its watchdog."""
    return output.startswith("{") and str(json_of(output)["failure"]).startswith(WATCHDOG_TRIP)


def start_fulmar(*arguments: str, env: dict[str, str], cwd: Path) -> psutil.Popen:
    """Start a command in the background."""
    return psutil.Popen(
        [*FULMAR, *arguments],
        env=env,
        cwd=cwd,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def child_running(parent: psutil.Popen, module: str, timeout_s: float = 30.0) -> psutil.Process:
    """The child of a run that runs a module, as soon as it is there."""
    until = time.monotonic() + timeout_s
    while time.monotonic() < until:
        for child in parent.children(recursive=True):
            with contextlib.suppress(psutil.Error):  # it may have ended meanwhile
                if module in child.cmdline():
                    return child
        time.sleep(0.05)
    raise AssertionError(f"no child runs {module}")


def under_way(run: psutil.Popen, bag: Path, messages: int, timeout_s: float = 40.0) -> bool:
    """Wait until a run's bag holds so many messages; false if the run has ended before."""
    until = time.monotonic() + timeout_s
    while time.monotonic() < until:
        if _messages_of(bag) >= messages:
            return True
        if run.poll() is not None:
            return False
        time.sleep(0.05)
    raise AssertionError(f"{bag} did not grow to {messages} messages")


def _messages_of(bag: Path) -> int:
    try:
        reported = yaml.safe_load((bag / "metadata.yaml").read_text(encoding="utf-8"))
    except FileNotFoundError:
        return 0
    return int(reported["rosbag2_bagfile_information"]["message_count"])


def json_of(output: str) -> dict[str, Any]:
    """The one JSON object that standard output must be."""
    return dict(json.loads(output))


def wait_for_children(parent: psutil.Popen, count: int, timeout_s: float = 30.0) -> list[psutil.Process]:
    """All children of a command, direct or not, as soon as there are so many."""
    until = time.monotonic() + timeout_s
    while time.monotonic() < until:
        children = parent.children(recursive=True)
        if len(children) >= count:
            return list(children)
        time.sleep(0.02)
    raise AssertionError(f"there are no {count} children")


def nothing_left(children: list[psutil.Process], timeout_s: float = 10.0) -> bool:
    """Whether every one of these processes ends in time."""
    _, alive = psutil.wait_procs(children, timeout=timeout_s)
    return not alive
