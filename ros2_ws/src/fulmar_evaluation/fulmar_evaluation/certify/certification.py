"""From the words of `fulmar certify` to a certified set, its table and its figure."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from fulmar_bringup.console import new_table
from fulmar_bringup.core_probe import ends_of
from fulmar_bringup.progress import work_bar
from fulmar_core.config.errors import ConfigError, did_you_mean
from fulmar_core.loop.policy_bundle import PASSPORT, read_passport
from fulmar_core.safety.certified_set import CertifiedSet
from fulmar_evaluation.certify.again import known_set, tested_again
from fulmar_evaluation.certify.conditions import axes_of
from fulmar_evaluation.certify.document import (
    check_backup,
    document_of,
    hashes_of,
    identity,
    mujoco_bounds,
    plain_axes,
)
from fulmar_evaluation.certify.episodes import Episodes
from fulmar_evaluation.certify.procedure import LEAST, Result, Sizes, certify
from fulmar_evaluation.evaluation import Trial
from fulmar_evaluation.trial_plan import plan_trial
from policy_server.controllers import CONTROLLERS, controller_entry

MUJOCO_COST = 100  # episodes of the batch that take as long as one in MuJoCo, for the bar


@dataclass(frozen=True)
class Certification:
    """What to certify, and how.

    Attributes:
        trial: Robot, task, controller and rate.
        bundle: Folder of the policy; None for a law.
        sizes: Numbers of episodes.
        seed: Of everything drawn.
        dead: Actuators that do nothing, a stratum of its own.
        backup: File of the backup's certified set; None: none.
        again: Whether a known set is tested, in place of searching for one: the passport's, or of a law that in `file`.
        file: Where the set of a law is written.
    """

    trial: Trial
    bundle: Path | None
    sizes: Sizes
    seed: int
    dead: int
    backup: Path | None
    again: bool = False
    file: Path | None = None


def plan_certification(
    controller: str,
    *,
    robot: str | None,
    task: str | None,
    seed: int,
    jobs: int | None,
    sizes: Sizes,
    dead: int,
    backup: Path | None,
    again: bool = False,
    file: Path | None = None,
) -> Certification:
    """Complete and check what is asked for before anything runs.

    Raises:
        ConfigError: Unknown names, or a controller, task or robot that no certification is for.
        BundleError: The bundle is damaged or made for something else.
    """
    folder = Path(controller) if (Path(controller) / PASSPORT).is_file() else None
    if folder is not None:
        passport = read_passport(folder)
        robot, task = robot or passport.robot, task or passport.task
    else:
        _check_name(controller)
    if robot is None or task is None:
        missing = "--robot" if robot is None else "--task"
        raise ConfigError(f"'{controller}' needs {missing}: only the passport of a bundle names its own.")
    trial = plan_trial(
        robot=robot, task=task, controller="policy" if folder is not None else controller, policy=folder,
        through="batch", episodes=None, seed=seed, scenario="nominal", control_hz=None,
        jobs=jobs or len(os.sched_getaffinity(0)), episode_s=None, steps=None, worlds=None, bounds=None,
    )  # fmt: skip
    axes_of(trial.robot, trial.task)
    count = len(trial.robot.actuators.names)
    if not 0 <= dead < count:
        raise ConfigError(f"--dead {dead}: '{robot}' has {count} actuators; give 0 to {count - 1}.")
    if backup is not None:
        check_backup(backup, trial)
    found = folder or (Path(trial.plan.policy) if trial.plan.policy else None)
    return Certification(trial, found, sizes, seed, dead, backup, again, file)


def _check_name(controller: str) -> None:
    if controller not in CONTROLLERS:
        raise ConfigError(
            f"'{controller}' is neither a policy bundle nor a controller.{did_you_mean(controller, CONTROLLERS)} "
            "Give the folder of a bundle, `policy` for the shipped one, or a law such as lqr or classical."
        )
    entry = controller_entry(controller)
    if not (entry.is_law or entry.runs_bundle):
        raise ConfigError(
            f"controller '{controller}' strives for no goal that an episode could be certified by."
        )


def run_certification(asked: Certification) -> tuple[dict[str, Any], Result]:
    """Certify with a progress bar.

    Returns:
        The document, whose `reason` says why there is no set where there is none; and what it came from.
    """
    sizes, began = asked.sizes, _cpu_s()
    total = sizes.expected + MUJOCO_COST * sizes.mujoco
    done = 0
    with work_bar("certifying") as show:

        def further(weight: int) -> Callable[[int], None]:
            def add(episodes: int) -> None:
                nonlocal done
                done += weight * episodes
                show(min(done, total), total)

            return add

        episodes = Episodes(asked.trial, asked.dead, further(1))
        known = known_set(episodes, asked.file) if asked.again else None
        hashes = _hashes(asked, known)
        result = _result(asked, episodes, known)
        if result.score is None:
            return _without_set(asked, episodes, result, began), result
        document = document_of(asked.trial, episodes.axes, result, seed=asked.seed)
        if sizes.mujoco:
            episodes.progress = further(MUJOCO_COST)
            rng = np.random.default_rng([asked.seed, len(episodes.axes), 1])
            succeeded = episodes.run_in_mujoco(result.score.set.sample(rng, sizes.mujoco))
            document["mujoco"] = mujoco_bounds(int(succeeded.sum()), len(succeeded))
    document |= {
        "controller": identity(asked.trial),
        "dead": asked.dead,
        "hashes": hashes,
        "probe": ends_of(asked.trial.controller(), asked.trial.robot, asked.trial.task),
        "cpu_s": round(_cpu_s() - began, 2),
    }
    return document, result


def _result(asked: Certification, episodes: Episodes, known: CertifiedSet | None) -> Result:
    """A search for a set, or a test of a known one."""
    if known is not None:
        return tested_again(known, episodes.run, asked.sizes, asked.seed)
    return certify(episodes.run, len(episodes.axes), asked.sizes, asked.seed)


def _hashes(asked: Certification, known: CertifiedSet | None) -> dict[str, str]:
    """Those of today; of the backup that of the known set, where no other one is given."""
    found = hashes_of(asked.trial, asked.backup)
    if known is not None and asked.backup is None:
        found["backup"] = str(known.plain.get("hashes", {}).get("backup", ""))
    return found


def _without_set(asked: Certification, tried: Episodes, result: Result, began: float) -> dict[str, Any]:
    plan = asked.trial.plan
    return {
        "robot": plan.robot,
        "task": plan.task,
        "controller": identity(asked.trial),
        "axes": plain_axes(tried.axes),
        "box": None,
        "score": None,
        "reason": result.reason,
        "dead": asked.dead,
        "episodes": tried.used,
        "cpu_s": round(_cpu_s() - began, 2),
    }


def _cpu_s() -> float:
    """Processor time of this process and of its children that have ended [s]."""
    return sum(os.times()[:4])


def print_certificate(found: dict[str, Any], output: Console) -> None:
    """Print a certified set for people, or why there is none."""
    name = f"{found['robot']} · {found['task']} · {found['controller'][:24]}"
    if found["score"] is None:
        line = f"{name}: no certified set: {found['reason']} ({found['cpu_s']:.0f} s of processor time)"
        output.print(line, markup=False, soft_wrap=True)
        return
    table = new_table(name, ["axis"], ["easiest", "certified to", "tried to", "unit"])
    for axis in found["axes"]:
        high = found["box"][axis["name"]][1]
        table.add_row(axis["name"], f"{axis['low']:g}", f"{high:.3g}", f"{axis['high']:.3g}", axis["unit"])
    output.print(table)
    rows = {"score": found, "box": found["box_test"]}
    for what, test in rows.items():
        if test is None:
            output.print(f"{what}: none met its bounds")
            continue
        edge = test["edge"]
        line = (
            f"{what}: {test['successes']} of {test['episodes']} fresh episodes succeed, lower bound "
            f"{test['lower_bound']:.3f} at {found['confidence']:.0%}; outer tenth {edge['mean']:.3f} of "
            f"{edge['episodes']}"
        )
        output.print(line, markup=False, soft_wrap=True)
    for line in warnings_of(found):
        output.print(f"warning: {line}", markup=False, soft_wrap=True)
    through = found["mujoco"]
    if through is not None:
        line = f"mujoco: {through['successes']} of {through['episodes']}, lower bound {through['lower_bound']:.3f}"
        output.print(line, markup=False, soft_wrap=True)
    output.print(f"{found['cpu_s']:.0f} s of processor time", markup=False)


def warnings_of(found: dict[str, Any]) -> tuple[str, ...]:
    """What a reader of a certified set should know before trusting it."""
    lines = []
    if found["mujoco"] is None:
        lines.append("no independent simulator has checked the set; see --mujoco")
    elif found["mujoco"]["lower_bound"] < LEAST:
        lines.append(f"in MuJoCo the lower bound is below {LEAST:g}: the core's batch is kinder than it")
    if found["box_test"] is None:
        lines.append("no box met its bounds, so that checks at the start have only the score")
    return tuple(lines)


def is_certified(found: dict[str, Any]) -> bool:
    """Whether a document has a certified set."""
    return found["score"] is not None
