"""Child processes of a run: output prefixed, stopped in order, never left behind.

psutil stops them in an order of our own and reaches processes that no longer react.
"""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Mapping
from dataclasses import dataclass
from typing import IO

import psutil

from fulmar_bringup.console import printable
from fulmar_bringup.node_spec import NodeSpec, Parameter
from fulmar_core.config.module_path import safe_environment
from fulmar_core.config.process import LAUNCHER_PID
from fulmar_ros.middleware import environment_of_any_node, middleware_environment

KILL_S = 2.0  # for a process to be gone after SIGKILL [s]
GLUE = "fulmar_ros."  # package whose modules have a `main` that runs a node
YIELDING = "fulmar_ros.yielding_start"
OWN = "fulmar_core.config.own_module"  # finds modules of users
PACKAGES = (GLUE, "sim_nodes.", "policy_server.", "hardware_drivers.", "tests.")  # of our nodes
LAST_WORDS_S = 1.0  # for what a child that ended has left in the pipe; a grandchild may keep it open


@dataclass(frozen=True)
class Ended:
    """How a child ended."""

    name: str
    returncode: int | None  # None: it could not be ended
    forced: bool = False  # we had to kill it
    optional: bool = False  # the system goes on without it

    @property
    def text(self) -> str:
        """For people."""
        if self.returncode is None:
            return f"{self.name} could not be ended"
        if self.returncode < 0:
            return f"{self.name} was killed by {signal.Signals(-self.returncode).name}"
        return f"{self.name} ended with exit code {self.returncode}"


class ProcessGroup:
    """The children of one run."""

    def __init__(self, environment: Mapping[str, str] | None = None, *, label: str = "") -> None:
        """Begin without children, whose environment is ours and what is given; `label` begins what they print."""
        self._label = label
        given = {**os.environ, **child_environment(), **(environment or {})}
        given |= safe_environment(given)
        self._environment = given | environment_of_any_node(given)
        self._children: dict[str, psutil.Popen] = {}
        self._relays: dict[str, _Relay] = {}
        self._specs: dict[str, NodeSpec] = {}

    def start(self, spec: NodeSpec, *, yielding: bool = False) -> None:
        """Start one node in a process of its own; `yielding`: beside a robot that moves, see `command_line`."""
        child = psutil.Popen(
            command_line(spec, yielding=yielding),
            env=self._environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            start_new_session=True,  # Ctrl-C reaches us alone; we stop the children in order
        )
        self._relays[spec.name] = _Relay(self._label + spec.name, child.stdout)
        self._specs[spec.name] = spec
        self._children[spec.name] = child
        self._relays[spec.name].start()

    def start_again(self, spec: NodeSpec) -> None:
        """Start a node in the place of its process that has ended or hangs; it keeps its place among the others."""
        old = self._children[spec.name]
        if old.poll() is None:
            old.kill()
            old.wait(KILL_S)
        self.start(spec, yielding=True)

    def process(self, name: str) -> psutil.Popen:
        """A child that was started."""
        return self._children[name]

    @property
    def specs(self) -> dict[str, NodeSpec]:
        """Rows of the children that were started and not stopped, by name."""
        return {name: self._specs[name] for name in self._children}

    def ended(self) -> Ended | None:
        """The first child found to have ended, or None; the end of an optional one is no end."""
        for name, child in self._children.items():
            code = child.poll()
            if code is not None and not self._specs[name].optional:
                return Ended(name, code)
        return None

    def is_stopped(self, name: str) -> bool:
        """Whether a child was stopped in its tracks, as by SIGSTOP."""
        try:
            return bool(self._children[name].status() == psutil.STATUS_STOPPED)
        except psutil.NoSuchProcess:
            return False

    def ask_to_stop(self, name: str, *, at_once: bool = False) -> None:
        """Ask a child to end in order, and do not wait; `at_once`: it is not to finish first what takes time."""
        child = self._children.get(name)
        if child is not None and child.poll() is None:
            child.send_signal(signal.SIGINT if at_once else signal.SIGTERM)

    def stop(self, *names: str) -> list[Ended]:
        """Stop children by name, asked first, then killed; returns how each ended, also before."""
        chosen = [(name, self._children[name]) for name in names if name in self._children]
        killed: set[int] = set()
        # Not SIGINT: it ends a node that still imports its modules with a traceback, SIGTERM without a word.
        ending_s = max((self._specs[name].patience_s for name, _ in chosen), default=0.0)
        for number, patience_s in ((signal.SIGTERM, ending_s), (signal.SIGKILL, KILL_S)):
            alive = [child for _, child in chosen if child.poll() is None]
            for child in alive:
                # A stopped process only reacts to SIGKILL.
                chosen_number = signal.SIGKILL if child.status() == psutil.STATUS_STOPPED else number
                if chosen_number == signal.SIGKILL:
                    killed.add(child.pid)
                child.send_signal(chosen_number)
            psutil.wait_procs(alive, timeout=patience_s)
        for name, _ in chosen:  # not before: whoever interrupts us can still stop them
            del self._children[name]
            if self._relays[name].ident is not None:  # Ctrl-C may have come before it was started
                self._relays[name].join(LAST_WORDS_S)
        return [
            Ended(name, child.poll(), forced=child.pid in killed, optional=self._specs[name].optional)
            for name, child in chosen
        ]

    def stop_all(self) -> list[Ended]:
        """Stop every child that is left, newest first, so that the recorder gets the last messages of the others."""
        return [end for name in reversed(list(self._children)) for end in self.stop(name)]

    def last_words(self, name: str, *, ended: bool = False) -> str:
        """Last line that a child printed, without the log prefix of ROS; of one that `ended` the pipe is drained."""
        if ended:
            self._relays[name].join(LAST_WORDS_S)
        text = self._relays[name].last_line
        return text.partition("]: ")[2] if text.startswith("[") and "]: " in text else text


def command_line(spec: NodeSpec, *, yielding: bool = False) -> list[str]:
    """Command that starts a node as a module of this interpreter, in its network namespace.

    Args:
        spec: Row of the node.
        yielding: Whether its start gives way to what runs already; a system's own module is a script, and does not.
    """
    arguments = ["-r", f"__ns:={spec.namespace}", "-r", f"__node:={spec.name}"]
    for key, value in spec.parameters.items():
        arguments += ["-p", f"{key}:={_yaml(value)}"]
    for topic, other in spec.remappings.items():
        arguments += ["-r", f"{topic}:={other}"]
    arguments += ["--log-level", "warn"] if spec.quiet else []
    elsewhere = ["ip", "netns", "exec", spec.network] if spec.network else []
    through = [] if spec.module.startswith(PACKAGES) else [OWN]
    if yielding and spec.module.startswith(GLUE):
        through = [YIELDING]
    return [*elsewhere, sys.executable, "-m", *through, spec.module, "--ros-args", *arguments]


def child_environment() -> dict[str, str]:
    """Environment that every node gets: local discovery unless asked otherwise, one thread for linear algebra."""
    return {
        **middleware_environment(),
        "OMP_NUM_THREADS": "1",
        "OPENBLAS_NUM_THREADS": "1",
        "PYTHONUNBUFFERED": "1",
        LAUNCHER_PID: str(os.getpid()),
    }


def _yaml(value: Parameter) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return "'" + value.replace("'", "''") + "'"  # single quotes are YAML's way to take text literally
    return repr(value)


class _Relay(threading.Thread):
    """Passes on what a child prints, and remembers the last line."""

    def __init__(self, name: str, stream: IO[bytes]) -> None:
        super().__init__(name=f"{name} output", daemon=True)
        self._child, self._stream = name, stream
        self.last_line = ""

    def run(self) -> None:
        for line in self._stream:
            text = printable(line.decode(errors="replace").rstrip())
            if not text:
                continue
            self.last_line = text
            # The terminal may be gone, but a pipe that is not emptied would block the child.
            with contextlib.suppress(OSError, ValueError, AttributeError):
                sys.stderr.write(f"[{self._child}] {text}\n")
                sys.stderr.flush()
