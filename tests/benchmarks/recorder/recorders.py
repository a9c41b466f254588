"""Recorder processes, and when they are ready."""

from __future__ import annotations

import contextlib
import os
import subprocess
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import psutil

from fulmar_bringup.processes import child_environment, command_line
from fulmar_bringup.run_plan import RunPlan
from fulmar_bringup.system_rows import system_rows
from fulmar_core.errors import RunFailed

START_TIMEOUT_S = 60.0
STOP_TIMEOUT_S = 20.0


class Recorder:
    """One recorder, the very process of `fulmar run`."""

    def __init__(self, plan: RunPlan, bag: Path) -> None:
        """Start it.

        Args:
            plan: Whose wires, and how.
            bag: Folder of the bag; must not exist.
        """
        self.bag = bag
        self._output = tempfile.TemporaryFile()  # noqa: SIM115 - lives as long as the process
        self.process = psutil.Popen(
            command_line(system_rows(plan, record={"directory": str(bag)})["recorder"]),
            env={**os.environ, **child_environment()},
            stdin=subprocess.DEVNULL,
            stdout=self._output,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )

    @property
    def said(self) -> str:
        """Everything that it printed."""
        return os.pread(self._output.fileno(), 1 << 20, 0).decode(errors="replace")

    def wait_until_recording(self) -> None:
        """Wait until the bag is there.

        Raises:
            RunFailed: The recorder ended, or takes too long.
        """
        until = time.monotonic() + START_TIMEOUT_S
        while "recording to" not in self.said:
            if self.process.poll() is not None or time.monotonic() > until:
                raise RunFailed(f"the recorder did not begin: {self.said.strip() or 'it said nothing'}")
            time.sleep(0.02)

    def kill(self) -> None:
        """End it with SIGKILL."""
        self.process.kill()
        self.process.wait()

    def stop(self) -> int:
        """End it in order; returns its exit code."""
        self.process.send_signal(2)
        return int(self.process.wait(STOP_TIMEOUT_S))

    def close(self) -> None:
        """Leave nothing behind."""
        with contextlib.suppress(psutil.NoSuchProcess):
            self.kill()
        self._output.close()


@contextlib.contextmanager
def recorders(plans: dict[Path, RunPlan]) -> Iterator[list[Recorder]]:
    """Recorders that all record; none is left when the context ends.

    Args:
        plans: Plan by bag folder.
    """
    with contextlib.ExitStack() as stack:
        started = []
        for bag, plan in plans.items():
            started.append(Recorder(plan, bag))
            stack.callback(started[-1].close)
        for recorder in started:
            recorder.wait_until_recording()
        yield started
