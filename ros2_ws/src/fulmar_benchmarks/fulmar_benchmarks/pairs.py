"""Pairs to evaluate, their controllers, and what their outcomes depend on."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fulmar_benchmarks.tables import display_name
from fulmar_benchmarks.unit import TrialCell, costs, where_of
from fulmar_bringup.run_plan import RunPlan
from fulmar_core.config.errors import BundleError, ConfigError
from fulmar_core.loop.policy_bundle import read_passport
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks import load_task
from fulmar_evaluation.evaluation import Trial
from policy_server.controllers import policies_directory, shipped_policy

KINDS = ("policy", "classical")


@dataclass(frozen=True)
class Pair:
    """A robot at a task, and who drives it."""

    robot: str
    task: str
    kind: str  # one of KINDS
    controller: str = ""  # empty: there is none
    law: str = ""  # of a classical controller
    policy: str = ""  # folder of a bundle
    reason: str = ""  # why there is none
    sha256: str = ""  # of whatever defines the controller
    passport: dict[str, Any] = field(default_factory=dict, hash=False)

    @property
    def missing(self) -> bool:
        """Whether it has no controller."""
        return not self.controller


def find_pair(robot: str, task: str, kind: str, policies: Path | None = None) -> Pair:
    """Find who drives a robot at a task.

    Returns:
        The pair, perhaps with a reason why it has no controller.
    """
    folder = (policies or policies_directory()) / f"{robot}_{task}"
    if kind == "policy":
        return with_policy(robot, task, folder)
    return with_law(robot, task, "classical")


def with_policy(robot: str, task: str, folder: Path) -> Pair:
    """A pair that the bundle of a folder drives, or why it cannot."""
    from policy_server.policy import Policy

    if not folder.is_dir():
        return Pair(robot, task, "policy", reason="no policy is shipped")
    try:
        passport = read_passport(folder)
        Policy(folder, load_robot(robot), load_task(task))
    except BundleError as error:
        return Pair(robot, task, "policy", reason=str(error))
    return Pair(
        robot,
        task,
        "policy",
        "policy",
        policy=str(folder.absolute()),
        sha256=passport.sha256,
        passport=passport.training,
    )


def with_law(robot: str, task: str, name: str) -> Pair:
    """A pair that a controller without a bundle drives, or why it cannot."""
    from policy_server.controllers import Choice, load_controller

    the_robot, the_task = load_robot(robot), load_task(task)
    try:
        choice = Choice(the_robot.timing.control_hz)
        controller = load_controller(name, the_robot, the_task, choice)
    except ConfigError as error:
        return Pair(robot, task, "classical", reason=str(error))
    found = controller.metadata()
    law = str(getattr(controller, "law", name))
    return Pair(robot, task, "classical", name, law=law, sha256=str(found["sha256"]))


def policy_hash(robot: str, task: str, controller: str, folder: str = "") -> str:
    """Hash of the bundle that drives, in a folder or the shipped one; empty for a controller without one."""
    bundle = (folder or shipped_policy(robot, task)) if controller == "policy" else None
    return read_passport(Path(bundle)).sha256 if bundle else ""


def plan_of(pair: Pair, *, scenario: str, seed: int, duration_s: float | None = None) -> RunPlan:
    """One episode of a pair in MuJoCo, in lock step; its length [s] is the task's own by default."""
    return RunPlan(
        robot=pair.robot,
        task=pair.task,
        controller=pair.controller,
        backend="mujoco",
        control_hz=load_robot(pair.robot).timing.control_hz,
        policy=pair.policy,
        scenario=scenario,
        seed=seed,
        duration_s=duration_s or load_task(pair.task).episode_s,
        lockstep=True,
    )


def cells_of(
    pair: Pair, ways: dict[str, int], *, seed: int, scenario: str, bounds: Path, worlds: int
) -> list[TrialCell]:
    """The work on one pair, so many episodes in each way."""
    plan, found = plan_of(pair, scenario=scenario, seed=seed), []
    for way, episodes in ways.items():
        trial = Trial(plan, way, episodes, worlds)
        title = f"{display_name(pair.robot)}, {display_name(pair.task).lower()}, {pair.controller}, {way}"
        found.append(
            TrialCell(
                name=f"{pair.robot}_{pair.task}_{pair.controller}_{way}", title=title, cost=costs(trial),
                where=where_of(trial), way=way, trial=trial, defines=pair.sha256, bounds=bounds,
            )
        )  # fmt: skip
    return found
