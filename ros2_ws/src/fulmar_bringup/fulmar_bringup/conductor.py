"""One run from start to finish: processes up, goal given, watched to its end, processes down, bag read."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from fulmar_bringup.bag_reader import read_run
from fulmar_bringup.console import console
from fulmar_bringup.node_table import RunPlan, controller_spec, plant_spec, recorder_spec
from fulmar_bringup.planning import RunRequest
from fulmar_bringup.processes import ProcessGroup
from fulmar_bringup.provenance import fulmar_version, git_revision
from fulmar_bringup.run_summary import summarise
from fulmar_bringup.supervisor import SILENT_S, START_TIMEOUT_S, Supervisor, supervisor
from fulmar_bringup.system import CONTROLLERS
from fulmar_core.errors import RunFailed
from fulmar_core.paths import config_path
from fulmar_core.state import planar_pose
from fulmar_core.tasks import load_task

LAST_WORDS_S = 0.5  # after a controller died, the plant still shows that its actuators are safe
GOAL_STAMP_NS = 1_000_000_000  # the simulated time at which every run begins


@dataclass(frozen=True)
class RunOutcome:
    """What came of a run."""

    summary: dict[str, Any]
    failure: str  # why it did not come to its planned end; empty if it did

    @property
    def exit_code(self) -> int:
        """0: ran to its end and met the goal; 1: not so."""
        return 0 if self.summary.get("success") and not self.failure else 1


def conduct(request: RunRequest) -> RunOutcome:
    """Run once.

    Args:
        request: What to run.

    Returns:
        The outcome; a failed run has one too, with everything that was recorded.

    Raises:
        BagError: If nothing readable was recorded at all.
    """
    plan = replace(request.plan, supervised=True)
    group = ProcessGroup()
    failure = ""
    try:
        group.start(recorder_spec(plan, **_recording(request)))
        group.start(plant_spec(plan, subscribers=2))  # controller and recorder
        group.start(controller_spec(plan, subscribers=2))  # plant and recorder
        task = load_task(plan.task)
        with supervisor(plan.robot, task) as overseer:
            failure = _watch(request, plan, overseer, group)
            # The controller first: the plant then shows that its actuators are safe, and the recorder sees it.
            group.stop("controller")
            group.stop("plant")
    except KeyboardInterrupt:
        failure = "stopped by the user"
    finally:
        group.stop_all()
    summary = summarise(read_run(request.record))
    return RunOutcome({**summary, "failure": failure or None}, failure)


def _watch(request: RunRequest, plan: RunPlan, overseer: Supervisor, group: ProcessGroup) -> str:
    """Start the run and wait for its end; returns why it failed, or an empty text."""
    began = time.monotonic()

    def starting() -> None:
        _raise_if_ended(group)
        if time.monotonic() - began > START_TIMEOUT_S:
            said = overseer.controller.message or "nothing"
            raise RunFailed(
                f"the nodes did not get ready within {START_TIMEOUT_S:g} s (the controller said: {said}). "
                "Is another system running in this ROS domain? Try `fulmar doctor`."
            )

    try:
        x, y, heading = request.goal
        goal = planar_pose(np.asarray(x), np.asarray(y), np.deg2rad(heading))
        overseer.give_goal(goal, time_ns=GOAL_STAMP_NS, alive=starting)
        overseer.start_plant(starting)
        with _progress(plan.duration_s) as moved:
            _wait_for_end(plan, overseer, group, moved)
    except RunFailed as error:
        time.sleep(LAST_WORDS_S)
        return _with_plant_reaction(str(error), overseer)
    return ""


def _wait_for_end(
    plan: RunPlan, overseer: Supervisor, group: ProcessGroup, moved: Callable[[float], None]
) -> None:
    began = time.monotonic()
    limit_s = 30.0 + 1.5 * plan.duration_s / plan.rate + (plan.duration_s if plan.lockstep else 0.0)

    def running() -> None:
        _raise_if_ended(group)
        moved(float(overseer.plant.values.get("sim_time_s", 0.0) or 0.0))
        now = time.monotonic()
        if overseer.plant.level == "error":
            raise RunFailed(f"plant: {overseer.plant.message}")
        if overseer.controller.level == "error":
            raise RunFailed(f"controller: {overseer.controller.message}")
        if not plan.lockstep and overseer.controller.heard and now - overseer.controller.heard > SILENT_S:
            raise RunFailed(
                f"controller: has not reported for {now - overseer.controller.heard:.1f} s; it hangs"
            )
        if now - began > limit_s:
            raise RunFailed(f"the run did not end within {limit_s:.0f} s of wall-clock time")

    def finished() -> bool:
        return overseer.plant.values.get("mode") == "finished" or overseer.plant.level == "error"

    overseer.wait_until(finished, running)
    running()


def _raise_if_ended(group: ProcessGroup) -> None:
    end = group.ended()
    if end is not None:
        raise RunFailed(f"{end.text} before the run was over")


def _with_plant_reaction(reason: str, overseer: Supervisor) -> str:
    reaction = overseer.plant.message
    if overseer.plant.level == "error" and reaction not in reason:
        return f"{reason}; plant: {reaction}"
    return reason


def _recording(request: RunRequest) -> dict[str, str]:
    plan = request.plan
    info = {
        **{key: value for key, value in asdict(plan).items() if key not in ("start", "supervised")},
        "start": list(plan.start),
        "goal": list(request.goal),
        "fulmar_version": fulmar_version(),
        "git_revision": git_revision(),
        "command": request.command,
    }
    files = {
        "robot.yaml": config_path("robots", plan.robot),
        "task.yaml": config_path("tasks", plan.task),
        "scenario.yaml": config_path("scenarios", plan.scenario),
    }
    assert plan.controller in CONTROLLERS
    return {
        "directory": str(request.record),
        "run_info": json.dumps(info),
        "attachments": json.dumps({name: str(path.absolute()) for name, path in files.items()}),
    }


class _progress:  # noqa: N801 - reads as a function where it is used
    """A bar over the simulated time, on standard error, only on a terminal."""

    def __init__(self, duration_s: float) -> None:
        self._bar = Progress(
            TextColumn("running"),
            BarColumn(),
            TextColumn("{task.completed:5.1f} of {task.total:.0f} s simulated"),
            TimeElapsedColumn(),
            console=console,
            disable=not console.is_terminal,
            transient=True,
        )
        self._task = self._bar.add_task("running", total=duration_s)

    def __enter__(self) -> Callable[[float], None]:
        self._bar.start()
        start_s = GOAL_STAMP_NS / 1e9
        return lambda sim_time_s: self._bar.update(self._task, completed=max(0.0, sim_time_s - start_s))

    def __exit__(self, *_: object) -> None:
        self._bar.stop()
