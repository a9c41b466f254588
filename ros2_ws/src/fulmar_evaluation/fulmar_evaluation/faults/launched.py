"""What `fulmar run` and `fulmar up` do with a plan, in a process of its own.

The fault suite starts it in the place of these commands, since its plans have relays and networks that no option
of theirs has. It prints the events of `fulmar up --json`, the last one with the reason of the end.
"""

from __future__ import annotations

import json
import os
import signal
import sys
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np

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
class WrittenPlan:
    """A complete plan of a task without things, as a file has it."""

    plan: RunPlan
    targets: Rows
    obstacles: Rows

    @property
    def whole(self) -> RunPlan:
        """The plan with its mission."""
        obstacles = np.array(self.obstacles) if self.obstacles else None
        return replace(self.plan, mission=goal_at(*self.targets, obstacles=obstacles))


def command_of(launcher: str, plan: RunPlan, folder: Path) -> list[str]:
    """Command line of a launcher of a plan, which is written into a folder."""
    mission = plan.mission
    assert mission is not None  # as in `completed`
    rows = np.asarray(mission.targets).tolist(), np.asarray(mission.obstacles).tolist()
    path = folder / "plan.json"
    path.write_text(json.dumps(asdict(WrittenPlan(replace(plan, mission=None), *rows))), encoding="utf-8")
    return [sys.executable, "-m", __name__, launcher, str(path)]


def main() -> None:
    """Run or keep up the plan of a file until its end, or until SIGINT or SIGTERM."""
    launcher, path = sys.argv[1:]
    plan = load_config(WrittenPlan, Path(path)).whole
    signal.signal(signal.SIGTERM, _on_terminate)
    end_with(os.getppid(), signal.SIGTERM)
    failure = ""
    try:
        failure = _launched(launcher, plan)
    except FulmarError as error:
        failure = str(error)
    except KeyboardInterrupt as stop:
        failure = str(stop)
    _emit(ENDS, failure=failure or None)
    sys.exit(FAILED if failure else 0)


def _launched(launcher: str, plan: RunPlan) -> str:
    """Why it failed; empty if it did not."""
    if launcher == RUN:
        return execute(plan).failure
    return keep_up(plan, _emit, lambda *_shown: None).failure


def _on_terminate(number: int, _frame: FrameType | None) -> None:
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    raise KeyboardInterrupt(f"stopped by {signal.Signals(number).name}")


def _emit(event: str, **fields: Any) -> None:
    sys.stdout.write(json.dumps({"event": event, **fields}) + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    main()
