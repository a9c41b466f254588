"""`fulmar run` or `fulmar up` in a process of its own, as people start it, for tests that harm its processes."""

from __future__ import annotations

import contextlib
import json
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import IO, Any

import psutil

COMMAND = (sys.executable, "-m", "fulmar_cli.main")
NODE = "__node:="  # in the command line of each process that runs a node
SPACE = "__ns:="
START_S = 40.0  # for a node or an event of a system that starts on a busy computer
STOP_S = 15.0  # for a command to end after SIGTERM, before it is killed with its nodes
LOOK_S = 0.02


class LaunchedCommand:
    """A launcher, the processes of its nodes, and what it prints.

    Attributes:
        process: The launcher: the process of `fulmar run` or `fulmar up`.
        events: What `fulmar up --json` has printed so far, one object for each event.
        log: Lines of standard error so far, those of the nodes among them.
    """

    def __init__(
        self,
        words: Sequence[str],
        *,
        environment: Mapping[str, str],
        folder: Path,
        command: Sequence[str] = COMMAND,
        spaces: Collection[str] = (),
    ) -> None:
        """Start a command.

        Args:
            words: Such as `("up", "mujoco_lqr", "--json")`.
            environment: Of the command, with its ROS domain.
            folder: Where it runs.
            command: What the words follow.
            spaces: Namespaces whose nodes `nodes` gives, of a fleet, where several have one name; empty: every one.
        """
        self._spaces = tuple(spaces)
        self.events: list[dict[str, Any]] = []
        self.log: list[str] = []
        self._output: list[str] = []
        self._seen: dict[int, psutil.Process] = {}
        self.process = psutil.Popen(
            [*command, *words],
            env=dict(environment),
            cwd=folder,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        streams = ((self.process.stdout, self._take_output), (self.process.stderr, self._take_log))
        self._readers = [threading.Thread(target=_read, args=pair, daemon=True) for pair in streams]
        for reader in self._readers:
            reader.start()

    @property
    def result(self) -> dict[str, Any]:
        """The one object that `fulmar run --json` prints at its end; empty before."""
        with contextlib.suppress(json.JSONDecodeError):
            return dict(json.loads("".join(self._output)))
        return {}

    def nodes(self) -> dict[str, psutil.Process]:
        """Processes of the nodes that run now, by the name of the node."""
        found: dict[str, psutil.Process] = {}
        with contextlib.suppress(psutil.Error):
            for child in self.process.children(recursive=True):
                self._seen[child.pid] = child
                name = _name_of(child)
                with contextlib.suppress(psutil.Error):  # it may have ended meanwhile
                    counts = not self._spaces or _word_of(child, SPACE) in self._spaces
                    if name and counts and child.status() != psutil.STATUS_ZOMBIE:
                        found[name] = child
        return found

    def node(self, name: str, *, other_than: int | None = None, timeout_s: float = START_S) -> psutil.Process:
        """The process of a node, as soon as it is there.

        Args:
            name: Such as `plant` or `recorder`.
            other_than: Id of a process that does not count: of the node before it was started again.
            timeout_s: How long to wait [s].

        Raises:
            TimeoutError: There is none in time; with what the command has printed.
        """
        found: list[psutil.Process] = []

        def there() -> bool:
            found[:] = [node for key, node in self.nodes().items() if key == name and node.pid != other_than]
            return bool(found)

        self.wait_until(there, f"process of node '{name}'", timeout_s)
        return found[0]

    def wait_for_event(self, name: str, times: int = 1, timeout_s: float = START_S) -> dict[str, Any]:
        """An event of `fulmar up --json`, as soon as it has been printed so often.

        Raises:
            TimeoutError: It was not in time; with what the command has printed.
        """

        def named() -> list[dict[str, Any]]:
            return [event for event in self.events if event["event"] == name]

        self.wait_until(lambda: len(named()) >= times, f"event '{name}'", timeout_s)
        return named()[times - 1]

    def wait_until(self, condition: Callable[[], bool], what: str, timeout_s: float) -> None:
        """Wait for something that is called `what`.

        Raises:
            TimeoutError: It did not come in time; with what the command has printed.
        """
        until_s = time.monotonic() + timeout_s
        while not condition():
            if time.monotonic() > until_s:
                said = "\n".join([*map(str, self.events), *self.log[-30:]])
                raise TimeoutError(f"no {what} within {timeout_s:g} s. The command said:\n{said}")
            time.sleep(LOOK_S)

    def wait(self, timeout_s: float) -> int:
        """Exit code of the command, once it has ended.

        Raises:
            psutil.TimeoutExpired: It has not in time [s].
        """
        until_s = time.monotonic() + timeout_s
        while self.process.poll() is None and time.monotonic() < until_s:
            self.nodes()  # those that are started last count among what may be left over, too
            time.sleep(LOOK_S)
        code = int(self.process.wait(max(0.0, until_s - time.monotonic())))
        for reader in self._readers:
            reader.join(2.0)
        return code

    def left_over(self, within_s: float = 5.0) -> list[psutil.Process]:
        """Processes of nodes that live on after so long [s], though they were seen and the launcher is gone."""
        _, alive = psutil.wait_procs(list(self._seen.values()), timeout=within_s)
        return [process for process in alive if process.status() != psutil.STATUS_ZOMBIE]

    def end(self) -> list[str]:
        """End the command in order where it runs, then kill whatever is left of it.

        Returns:
            Names of nodes that were left over once the command had ended.
        """
        self.nodes()
        if self.process.poll() is None:
            self.process.resume()  # a test may have stopped it
            self.process.terminate()
            with contextlib.suppress(psutil.TimeoutExpired):
                self.wait(STOP_S)
        left = self.left_over() if self.process.poll() is not None else list(self._seen.values())
        names = [_name_of(process) for process in left]
        for process in (self.process, *left):
            with contextlib.suppress(psutil.Error):
                process.kill()
        self.process.wait(STOP_S)
        return [name for name in names if name]

    def _take_output(self, line: str) -> None:
        if line.startswith('{"event"'):
            self.events.append(json.loads(line))
        else:
            self._output.append(line)

    def _take_log(self, line: str) -> None:
        self.log.append(line.rstrip("\n"))


@contextlib.contextmanager
def launched(
    words: Sequence[str], *, environment: Mapping[str, str], folder: Path
) -> Iterator[LaunchedCommand]:
    """A command that runs until the context ends, at the latest; arguments as in `LaunchedCommand`."""
    command = LaunchedCommand(words, environment=environment, folder=folder)
    try:
        yield command
    finally:
        command.end()


def _name_of(process: psutil.Process) -> str:
    """The node that a process runs; empty once it has ended, and of one that runs none."""
    return _word_of(process, NODE)


def _word_of(process: psutil.Process, prefix: str) -> str:
    """What follows a prefix in the command line of a process; empty where it has none, or has ended."""
    with contextlib.suppress(psutil.Error):
        return next((word.removeprefix(prefix) for word in process.cmdline() if word.startswith(prefix)), "")
    return ""


def _read(stream: IO[str], take: Callable[[str], None]) -> None:
    for line in stream:
        take(line)
