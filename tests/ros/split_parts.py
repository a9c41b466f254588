"""A part of a split system in a container of its own, made of Linux namespaces."""

from __future__ import annotations

import json
import signal
import threading
import time
from pathlib import Path
from typing import Any

import psutil

from tests.ros.neighbour import until

OTHER_USER = "65534"  # another user than that of the plant
# The interpreter may lie in the home of the other user; this lets it be read, and nothing be written.
READS_ALL = ("--inh-caps", "+dac_read_search", "--ambient-caps", "+dac_read_search")
# IPC and mount namespaces, and shared memory that nothing outside sees.
PRIVATE_MEMORY = 'mount -t tmpfs -o mode=1777 tmpfs /dev/shm && exec "$@"'


def in_container(host: str, command: list[str], *, other_user: bool) -> list[str]:
    """A command in a network namespace, with IPC, mounts and shared memory of its own."""
    user = (
        ["setpriv", "--reuid", OTHER_USER, "--regid", OTHER_USER, "--clear-groups", *READS_ALL]
        if other_user
        else []
    )
    return [
        *("ip", "netns", "exec", host, "unshare", "--ipc", "--mount", "--propagation", "private"),
        *("sh", "-c", PRIVATE_MEMORY, "container", *user, *command),
    ]


class Part:
    """A running command, the events that it has printed, and its messages."""

    def __init__(self, command: list[str], env: dict[str, str], folder: Path) -> None:
        self.process = psutil.Popen(command, env=env, cwd=folder, stdin=-3, stdout=-1, stderr=-1, text=True)
        self.events: list[dict[str, Any]] = []
        self.errors: list[str] = []
        for read in (self._read_events, self._read_errors):
            threading.Thread(target=read, daemon=True).start()

    def _read_events(self) -> None:
        for line in self.process.stdout:
            if line.startswith("{"):
                self.events.append(json.loads(line))

    def _read_errors(self) -> None:
        for line in self.process.stderr:
            self.errors.append(line.rstrip())

    def of(self, name: str) -> list[dict[str, Any]]:
        """Events of a name."""
        return [event for event in list(self.events) if event["event"] == name]

    def wait_for(self, name: str, times: int = 1, timeout_s: float = 40.0) -> None:
        """Until an event has come so often."""
        try:
            until(lambda: len(self.of(name)) >= times, timeout_s)
        except AssertionError as error:
            raise AssertionError(f"no {name} for the {times}. time: {self.events} {self.errors}") from error

    def end(self, number: signal.Signals) -> int:
        """Send a signal, and wait for the end; returns the exit code."""
        self.process.send_signal(number)
        return int(self.process.wait(30.0))

    def kill(self) -> float:
        """Kill every process at once, as a container is killed; returns when, by the monotonic clock [s]."""
        killed_s = time.monotonic()
        if self.process.poll() is None:
            group = [self.process, *self.process.children(recursive=True)]
            killed_s = time.monotonic()
            for process in group:
                process.kill()
            psutil.wait_procs(group, timeout=10.0)
        return killed_s
