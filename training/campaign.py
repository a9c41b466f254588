"""Several seeds of one training: mean and spread of the success, and the best run."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from training.advice import advice
from training.executors import Executor, Watch
from training.jobs import Job, Outcome

CAMPAIGN_FILE = "campaign.json"


def run_campaign(jobs: Sequence[Job], executor: Executor, out: Path, watch: Watch) -> dict[str, Any]:
    """Run one job for each seed, and write what came out.

    Returns:
        The content of `campaign.json`: each seed's success, their mean and spread, and the best run.
    """
    out.mkdir(parents=True, exist_ok=True)
    result = summarised(executor.run(jobs, watch))
    (out / CAMPAIGN_FILE).write_text(json.dumps(result, indent=2) + "\n", encoding="utf-8")
    return result


def summarised(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """One line for each seed, statistics over those that did not fail, and the best run."""
    lines = [_line(outcome) for outcome in outcomes]
    values = [outcome.success for outcome in outcomes if outcome.record is not None]
    best = max((o for o in outcomes if o.record is not None), key=_rank, default=None)
    mean = sum(values) / len(values) if values else None
    return {
        "robot": outcomes[0].job.robot,
        "task": outcomes[0].job.task,
        "seeds": lines,
        "failed": sum(outcome.record is None for outcome in outcomes),
        "success_mean": mean,
        "success_std": math.sqrt(sum((v - mean) ** 2 for v in values) / len(values))
        if mean is not None
        else None,
        "best_seed": best.job.seed if best else None,
        "best_run": str(best.job.out) if best else None,
    }


def _line(outcome: Outcome) -> dict[str, Any]:
    record = outcome.record
    if record is None:
        return {"seed": outcome.job.seed, "run": str(outcome.job.out), "error": outcome.error}
    return {
        "seed": outcome.job.seed,
        "run": str(outcome.job.out),
        "success_held_out": record["best"]["success_rate"],
        "success_mujoco": record["mujoco"]["success_rate"] if "mujoco" in record else None,
        "score": record["best"]["score"],
        "steps": record["steps"],
        "wall_s": record["wall_s"],
    }


def _rank(outcome: Outcome) -> tuple[float, float]:
    assert outcome.record is not None
    return outcome.success, outcome.record["best"]["score"]


def campaign_text(result: dict[str, Any], out: Path) -> str:
    """A table of `run_campaign`'s result for people."""
    lines = [f"{'seed':>6}  {'held out':>8}  {'MuJoCo':>7}  {'steps':>12}"]
    for each in result["seeds"]:
        if "error" in each:
            lines.append(f"{each['seed']:>6}  failed: {each['error']}")
            continue
        mujoco = "-" if each["success_mujoco"] is None else f"{each['success_mujoco']:.3f}"
        lines.append(
            f"{each['seed']:>6}  {each['success_held_out']:>8.3f}  {mujoco:>7}  {each['steps']:>12,}"
        )
    if result["best_run"] is None:
        return "\n".join([*lines, f"no run of {out} succeeded"])
    mean, spread = result["success_mean"], result["success_std"]
    lines.append(f"success {mean:.3f} ± {spread:.3f}; best: seed {result['best_seed']}")
    best = next(each for each in result["seeds"] if each["seed"] == result["best_seed"])
    success = best["success_held_out"] if best["success_mujoco"] is None else best["success_mujoco"]
    record = {key: result[key] for key in ("robot", "task")} | {key: best[key] for key in ("steps", "wall_s")}
    return "\n".join([*lines, *advice(Path(result["best_run"]), record, success)])
