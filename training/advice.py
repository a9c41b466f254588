"""What to do after a training: export what has learned, or go on, beside what the shipped policies needed."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from fulmar_core.config.errors import FulmarError
from fulmar_core.loop.policy_bundle import Passport, read_passport
from fulmar_core.robots.robot_file import load_robot
from policy_server.controllers import shipped_policies, shipped_policy

SHORT_OF = 0.15  # success below that of the shipped policy with which a run has not learned the task yet [-]
LEARNED = 0.8  # success that is asked for where nothing is shipped for a kind of robot [-]
SPARE = 1.25  # of the time that the shipped policy's steps take on this computer


def usual_training(robot: str, task: str) -> dict[str, Any] | None:
    """What the shipped policy for a robot and a task needed.

    Where none is shipped for them: the one that needed most steps among those of the task for other robots of that
    kind, else among all of that kind.

    Returns:
        `robot`, `task`, `steps`, `updates`, `wall_s` of the computer that made it and `success`; None where there is
        none of that kind.
    """
    own, kind = shipped_policy(robot, task), load_robot(robot).kind
    known = map(_usual, [own] if own is not None else shipped_policies())
    of_kind = [found for found in known if found and load_robot(found["robot"]).kind is kind]
    same_task = [found for found in of_kind if found["task"] == task]
    return max(same_task or of_kind, key=lambda found: int(found["steps"]), default=None)


def _usual(bundle: Path) -> dict[str, Any]:
    """What a bundle's passport says of its training; empty where that cannot be read."""
    try:
        return _said(read_passport(bundle))
    except (FulmarError, KeyError):
        return {}


def _said(passport: Passport) -> dict[str, Any]:
    made = passport.training
    settings = made["settings"]
    return {
        "robot": passport.robot,
        "task": passport.task,
        "steps": made["steps"],
        "updates": round(made["steps"] / (settings["worlds"] * settings["algorithm"]["steps"])),
        "wall_s": made["wall_s"],
        "success": made["mujoco"]["success_rate"],
    }


def advice(run: Path, record: dict[str, Any], success: float) -> list[str]:
    """What to do with a run, a line each.

    Args:
        run: Run folder.
        record: Its record, with `robot`, `task`, `steps` and `wall_s`, and `algorithm` where it is not PPO.
        success: Its success rate in MuJoCo, or where it was not evaluated there on held-out episodes.
    """
    usual = usual_training(record["robot"], record["task"])
    enough = usual["success"] - SHORT_OF if usual else LEARNED
    if success >= enough:
        return [f"next: fulmar export {run} --out DIR"]
    lines = [
        f"the task is not learned yet: {success:.3f} of the episodes succeed, {enough:.3f} or more are expected"
    ]
    if record.get("algorithm", "ppo") != "ppo":
        usual = None  # the steps of the shipped policies, all of PPO, say nothing of another algorithm
    elif usual is None:
        lines.append(
            f"usual: no policy is shipped for {load_robot(record['robot']).kind.plural} to compare with"
        )
    else:
        same = (usual["robot"], usual["task"]) == (record["robot"], record["task"])
        whose = (
            "the shipped policy" if same else f"the shipped policy of {usual['robot']} for {usual['task']}"
        )
        lines.append(
            f"usual: {whose} took {usual['updates']} updates ({usual['steps']:,} steps; {usual['wall_s']:.0f} s on the "
            f"computer that made it) and succeeds in {usual['success']:.3f}; this run had {record['steps']:,} steps in "
            f"{record['wall_s']:.0f} s"
        )
    lines.append(f"to go on: fulmar train --resume {run} --time-limit {_enough_s(record, usual)}")
    lines.append(f"to export it as it is: fulmar export {run} --out DIR")
    return lines


def _enough_s(record: dict[str, Any], usual: dict[str, Any] | None) -> int:
    """Time of learning, in all, by which the steps of the shipped policy are done here, at least twice what was [s]."""
    pace = record["wall_s"] / max(1, record["steps"])
    needed = SPARE * pace * usual["steps"] if usual else 0.0
    return 10 * math.ceil(max(needed, 2.0 * record["wall_s"]) / 10.0)
