"""What `fulmar run` and `fulmar up` do with a request, in a process of its own.

The fault suite starts it in the place of these commands, since its requests have relays and networks that no option
of theirs has. It prints the events of `fulmar up --json`, the last one with the reason of the end.
"""

from __future__ import annotations

import json
import os
import signal
import sys
from dataclasses import asdict, dataclass
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np

from fulmar_bringup.planning import RunRequest
from fulmar_bringup.run_executor import execute
from fulmar_bringup.run_plan import RunPlan
from fulmar_bringup.standing_system import keep_up
from fulmar_core.config.errors import FAILED, FulmarError
from fulmar_core.config.process import end_with
from fulmar_core.config.strict_yaml import load_config
from fulmar_core.tasks.goal import goal_at

LAUNCHERS = RUN, UP = ("run", "up")
ENDS = "stopped"  # the last event
Rows = tuple[tuple[float, ...], ...]


@dataclass(frozen=True)
class WrittenRequest:
    """A `RunRequest` of a task without things, as a file has it."""

    plan: RunPlan
    goal: tuple[float, ...] | None
    record: str
    command: str
    targets: Rows
    obstacles: Rows

    @property
    def request(self) -> RunRequest:
        """What is asked for."""
        obstacles = np.array(self.obstacles) if self.obstacles else None
        mission = goal_at(*self.targets, obstacles=obstacles)
        return RunRequest(self.plan, self.goal, Path(self.record), self.command, mission)


def command_of(launcher: str, request: RunRequest, folder: Path) -> list[str]:
    """Command line of a launcher of a request, which is written into a folder."""
    mission = request.mission
    written = WrittenRequest(
        request.plan,
        request.goal,
        str(request.record),
        request.command,
        np.asarray(mission.targets).tolist(),
        np.asarray(mission.obstacles).tolist(),
    )
    path = folder / "request.json"
    path.write_text(json.dumps(asdict(written)), encoding="utf-8")
    return [sys.executable, "-m", __name__, launcher, str(path)]


def main() -> None:
    """Run or keep up the request of a file until its end, or until SIGINT or SIGTERM."""
    launcher, path = sys.argv[1:]
    request = load_config(WrittenRequest, Path(path)).request
    signal.signal(signal.SIGTERM, _on_terminate)
    end_with(os.getppid(), signal.SIGTERM)
    failure = ""
    try:
        failure = _launched(launcher, request)
    except FulmarError as error:
        failure = str(error)
    except KeyboardInterrupt as stop:
        failure = str(stop)
    _emit(ENDS, failure=failure or None)
    sys.exit(FAILED if failure else 0)


def _launched(launcher: str, request: RunRequest) -> str:
    """Why it failed; empty if it did not."""
    if launcher == RUN:
        return execute(request).failure
    return keep_up(request, _emit, lambda *_shown: None).failure


def _on_terminate(number: int, _frame: FrameType | None) -> None:
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    raise KeyboardInterrupt(f"stopped by {signal.Signals(number).name}")


def _emit(event: str, **fields: Any) -> None:
    sys.stdout.write(json.dumps({"event": event, **fields}) + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    main()
