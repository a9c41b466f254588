"""What a twin is asked for, checked before anything is computed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from fulmar_bags.bag_reading import BagReading
from fulmar_bags.run_record import read_any_run
from fulmar_core.config.errors import ConfigError
from fulmar_core.loop.policy_bundle import read_passport
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks import load_task
from policy_server.controllers import shipped_policy

KEPT = 0.9  # success of the old bundle from which on it is kept [-]
EPISODES = 256  # of each evaluation


@dataclass(frozen=True)
class TwinRequest:
    """The options of `fulmar twin`."""

    bags: tuple[Path, ...]
    out: Path  # folder of the steps
    policy: Path  # the bundle in use
    robot: str
    task: str
    known: tuple[str, ...]
    ballast: tuple[str, ...]
    reading: BagReading
    retrain_below: float  # success under which a new bundle is trained [-]
    updates: int | None  # of that training; those of the shipped policy by default
    episodes: int
    bundle: Path | None  # where an accepted bundle is written to
    command: str  # command line, for records


def robot_of(bags: Sequence[Path], reading: BagReading) -> tuple[str, str]:
    """Robot and task that bags name; the task is empty where they name several or none.

    Raises:
        ConfigError: They are of several robots, or one does not say its robot.
        BagError: One cannot be read.
    """
    infos = [(bag, read_any_run(bag, reading).info) for bag in bags]
    for bag, info in infos:
        if not info.get("robot"):
            raise ConfigError(f"{bag}: the bag does not say its robot. Give --robot.")
    robots = {str(info["robot"]): bag for bag, info in infos}
    if len(robots) > 1:
        (first, bag), (second, other) = list(robots.items())[:2]
        raise ConfigError(
            f"the bags are of several robots: {bag} of '{first}', {other} of '{second}'. A twin is of one robot: "
            "give the bags of each to a `fulmar twin` of its own."
        )
    tasks = {str(info.get("task") or "") for _, info in infos}
    return next(iter(robots)), tasks.pop() if len(tasks) == 1 else ""


def chosen_bundle(robot: str, task: str, policy: Path | None) -> tuple[Path, str]:
    """The bundle in use and its task.

    Args:
        robot: Name of the robot.
        task: Name of the task that was asked for or that the bags name; empty: the bundle's.
        policy: Bundle that was given; None: the shipped one.

    Raises:
        ConfigError: No bundle is given, and none is shipped; or the bags name no task.
        BundleError: The bundle is damaged or made for another robot.
    """
    if policy is None:
        if not task:
            raise ConfigError("the bags do not say one task. Give --task or --policy.")
        load_task(task).check(load_robot(robot))
        policy = shipped_policy(robot, task)
        if policy is None:
            raise ConfigError(
                f"no policy is shipped for '{robot}' and '{task}'. Give the bundle in use: --policy DIR, or the task "
                "that it is for: --task T."
            )
        return policy, task
    passport = read_passport(policy)
    if passport.robot != robot:
        raise ConfigError(
            f"--policy {policy}: is for '{passport.robot}', the bags are of '{robot}'. Give a bundle of '{robot}'."
        )
    return policy, passport.task


def check_target(bundle: Path | None, *, accept: bool) -> None:
    """Reject a place for the accepted bundle before hours of work.

    Raises:
        ConfigError: There is none, or it is not empty, or nothing is accepted.
    """
    if accept and bundle is None:
        raise ConfigError("--accept writes a bundle: say where, with --bundle DIR.")
    if bundle is None:
        return
    if not accept:
        raise ConfigError(f"--bundle {bundle}: nothing is written there without --accept. Give both.")
    if bundle.exists() and (not bundle.is_dir() or any(bundle.iterdir())):
        raise ConfigError(
            f"--bundle {bundle}: exists already and is not empty; no bundle is overwritten. Give another folder."
        )
