"""Child processes: started together, output prefixed, stopped in order, never left behind.

psutil does the process work: of the kept libraries it alone lets us stop in an order of our own and reach
processes that no longer listen.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Mapping
from dataclasses import dataclass

import psutil

from fulmar_bringup.node_table import NodeSpec, Parameter

PATIENCE_S = 4.0  # for an orderly end, before it is no longer asked for


@dataclass(frozen=True)
class Ended:
    """How a child ended."""

    name: str
    returncode: int

    @property
    def text(self) -> str:
        """For people."""
        if self.returncode < 0:
            return f"{self.name} was killed by {signal.Signals(-self.returncode).name}"
        return f"{self.name} ended with exit code {self.returncode}"


class ProcessGroup:
    """The children of one run."""

    def __init__(self, environment: Mapping[str, str] | None = None) -> None:
        """Begin without children.

        Args:
            environment: Of every child, on top of ours.
        """
        self._environment = {**os.environ, **child_environment(), **(environment or {})}
        self._children: dict[str, psutil.Popen] = {}
        self._readers: list[threading.Thread] = []

    def start(self, spec: NodeSpec) -> None:
        """Start one node in a process of its own."""
        child = psutil.Popen(
            command_line(spec),
            env=self._environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            start_new_session=True,  # Ctrl-C reaches us alone; we stop the children in order
        )
        self._children[spec.name] = child
        reader = threading.Thread(target=_relay, args=(spec.name, child.stdout), daemon=True)
        reader.start()
        self._readers.append(reader)

    def ended(self) -> Ended | None:
        """The first child found to have ended, or None."""
        for name, child in self._children.items():
            code = child.poll()
            if code is not None:
                return Ended(name, code)
        return None

    def stop(self, *names: str) -> list[Ended]:
        """Stop some children and wait for them: asked first, then told, then ended.

        Args:
            names: Which; those that have ended already are reported too.

        Returns:
            How each ended.
        """
        chosen = [(name, self._children.pop(name)) for name in names if name in self._children]
        for number, patience_s in ((signal.SIGINT, PATIENCE_S), (signal.SIGTERM, 1.0), (signal.SIGKILL, 2.0)):
            alive = [child for _, child in chosen if child.poll() is None]
            for child in alive:
                # A stopped process hears nothing but the last signal.
                asleep = child.status() == psutil.STATUS_STOPPED
                child.send_signal(signal.SIGKILL if asleep else number)
            psutil.wait_procs(alive, timeout=patience_s)
        return [Ended(name, int(child.poll() or 0)) for name, child in chosen]

    def stop_all(self) -> list[Ended]:
        """Stop every child that is left: newest first, so that the recorder sees the others' last words."""
        return [end for name in reversed(list(self._children)) for end in self.stop(name)]

    def pid(self, name: str) -> int:
        """Process id of a child."""
        return int(self._children[name].pid)


def command_line(spec: NodeSpec) -> list[str]:
    """Command that starts a node as a module of this interpreter."""
    arguments = ["-r", f"__ns:={spec.namespace}", "-r", f"__node:={spec.name}"]
    for key, value in spec.parameters.items():
        arguments += ["-p", f"{key}:={_yaml(value)}"]
    return [sys.executable, "-m", spec.module, "--ros-args", *arguments]


def child_environment() -> dict[str, str]:
    """Environment that every node gets: local discovery unless asked otherwise, one thread for linear algebra."""
    return {
        "ROS_AUTOMATIC_DISCOVERY_RANGE": os.environ.get("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST"),
        "OMP_NUM_THREADS": "1",
        "OPENBLAS_NUM_THREADS": "1",
        "PYTHONUNBUFFERED": "1",
        "FULMAR_PARENT_PID": str(os.getpid()),
    }


def _yaml(value: Parameter) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return "'" + value.replace("'", "''") + "'"  # single quotes are YAML's way to take text literally
    return repr(value)


def _relay(name: str, stream: object) -> None:
    for line in stream:  # type: ignore[attr-defined]
        text = line.decode(errors="replace").rstrip()
        if text:
            sys.stderr.write(f"[{name}] {text}\n")
            sys.stderr.flush()
