"""Run once, and say from the bag how it went."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fulmar_bags.run_record import Actuation, Motion, RunRecord, read_run
from fulmar_bringup.bag_origin import run_info
from fulmar_bringup.readiness import command_input
from fulmar_bringup.run_executor import Execution, execute
from fulmar_bringup.run_plan import RunPlan
from fulmar_core.config.errors import FulmarError
from fulmar_evaluation.run_summary import summarise
from policy_server.controllers import controller_entry

# A ring buffer that no fault wrote holds no evidence of success.
_NOT_EVALUATED: dict[str, Any] = {"success": None, "bag": None, "failure": None}


@dataclass(frozen=True)
class RunOutcome:
    """Result of a run."""

    summary: dict[str, Any]
    failure: str  # why it did not come to its planned end; empty if it did

    @property
    def exit_code(self) -> int:
        """0: ran to its end and met the goal, had none, or recorded nothing to evaluate; 1: otherwise."""
        missed = self.summary["success"] is False and controller_entry(self.summary["controller"]).strives
        return 1 if missed or self.failure else 0


def run_and_evaluate(plan: RunPlan) -> RunOutcome:
    """Run once and evaluate the bag.

    Returns:
        The outcome; a failed run has one too, with whatever was recorded.

    Raises:
        ConfigError: Another run goes on in this ROS domain, a plant of this name lives in it, or the plant refused its
            configuration.
        DeviceError: The device is not there.
    """
    return evaluate_execution(plan, execute(plan))


def evaluate_execution(
    plan: RunPlan, execution: Execution, read: Callable[[Path], RunRecord] = read_run
) -> RunOutcome:
    """Evaluate a run that has ended, from its bag, which is read by `read`."""
    record, failure, ring = Path(plan.record), execution.failure, plan.recording.mode == "ring"
    if ring and not failure and not record.exists():
        return RunOutcome({**summarise(_nothing_recorded(plan)), **_NOT_EVALUATED}, "")
    try:
        summary = summarise(read(record))
    except FulmarError as error:
        failure, summary = failure or str(error), summarise(_nothing_recorded(plan))
        summary["bag"] = plan.record if record.exists() else None
    summary["warnings"] = [*summary["warnings"], *dict.fromkeys(execution.warnings)]
    external = controller_entry(plan.controller).is_external
    if not failure and not ring and external and not summary["steps"]:
        failure = f"no command came on {command_input(plan).topic}: your controller published none"
    lost = execution.plant_steps - summary["steps"]
    if not failure and not ring and lost > 0:
        failure = f"the bag lacks {lost} of {execution.plant_steps} commands"
    failure = failure or summary["tank_empty"] or ""
    return RunOutcome({**summary, "failure": failure or None}, failure)


def _nothing_recorded(plan: RunPlan) -> RunRecord:
    """The record of a run without a bag: its plan, and nothing else."""
    none, vectors = np.empty(0), np.empty((0, 3))
    motion = Motion(none, none, none, vectors, np.empty((0, 4)), vectors, vectors)
    actuation = Actuation(none, none, none, (), np.empty((0, 0)))
    return RunRecord(
        path=Path(plan.record),
        info=json.loads(run_info(plan)),
        truth=motion,
        odom=motion,
        applied=actuation,
        commanded=actuation,
        goals=(),
        obstacles=np.empty((0, 3)),
        things={},
        controller={},
        health=(),
        warnings=(),
    )
