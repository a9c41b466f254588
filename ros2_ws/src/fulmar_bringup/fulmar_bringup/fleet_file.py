"""Fleets of `configs/systems`: files with `robots:`, each of them a system of its own in one world."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from fulmar_bringup.system import NONE, Guards, System, check_names, load_system
from fulmar_core.config.errors import ConfigError
from fulmar_core.config.paths import config_names, config_path
from fulmar_core.config.recording import Recording
from fulmar_core.config.strict_yaml import load_config
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import GOAL_POSE
from fulmar_core.tasks import load_task
from fulmar_core.tasks.swap_places import SWAP_PLACES, swap_places
from fulmar_core.wires.robot_name import FLEET, check_robot_name

FORMATION = "formation"
TASKS = (SWAP_PLACES, FORMATION)  # of all robots together


@dataclass(frozen=True)
class FleetRow:
    """One robot of a fleet, with the keys of a system."""

    robot: str
    task: str
    controller: str
    name: str = ""  # what the robot is called; empty: as its type
    backend: str = "mujoco"
    control_hz: float = 0.0  # 0: that of the fleet [Hz]
    start: tuple[float, ...] = ()  # in the frame that all share: x, y [m], heading [deg]
    goal: tuple[float, ...] = ()  # the same; for `fulmar run` [m, deg]
    goals: str = ""  # a file of configs/goals, for `fulmar run`
    place: tuple[float, ...] = ()  # in a formation: from the leader x, y [m], and heading in the room [deg]
    policy: str = ""  # folder of a bundle; empty: the shipped one
    scenario: str = "nominal"
    guards: Guards = NONE
    keep_apart: bool = False  # a guard bounds its speed towards the other robots

    def __post_init__(self) -> None:
        """Refuse what has no meaning."""
        if self.name:
            check_robot_name(self.name)
        if len(self.start) not in (0, 3) or len(self.goal) not in (0, 2, 3):
            raise ValueError("'start' needs three numbers: x, y [m], heading [deg]; 'goal' two or three.")
        if len(self.place) not in (0, 3):
            raise ValueError("'place' needs three numbers: x, y from the leader [m], heading [deg].")
        if self.goal and self.goals:
            raise ValueError("'goal' and 'goals' are two goals. Give one of them.")

    @property
    def called(self) -> str:
        """What the robot is called."""
        return self.name or self.robot


@dataclass(frozen=True)
class Fleet:
    """One file of `configs/systems` with several robots."""

    title: str
    robots: tuple[FleetRow, ...]
    control_hz: float  # of every robot that has none of its own [Hz]
    task: str = ""  # of all together, one of `TASKS`, which draws starts and goals; empty: each has its own
    least_distance: float = 0.0  # between any two hulls, below which a run fails [m]
    shape_error: float = (
        0.3  # rms distance of a robot from its place in a formation, above which a run fails [m]
    )
    recorder: Recording = Recording()

    def __post_init__(self) -> None:
        """Refuse what is no fleet."""
        if len(self.robots) < 2:
            raise ValueError("'robots' needs at least two robots.")
        if self.control_hz <= 0.0:
            raise ValueError(f"'control_hz' = {self.control_hz:g} must be greater than 0.")
        if self.least_distance < 0.0:
            raise ValueError(f"'least_distance' = {self.least_distance:g} must not be negative.")
        if self.task not in ("", *TASKS):
            raise ValueError(f"'task' = '{self.task}' of a fleet must be one of {', '.join(TASKS)}.")
        if self.recorder.mode != "whole":
            raise ValueError(f"'recorder' has mode '{self.recorder.mode}'; a fleet has one whole bag.")
        names = [row.called for row in self.robots]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"two robots are called '{name}'. Give each a 'name' of its own.")
        if FLEET in names:
            raise ValueError(f"no robot of a fleet may be called '{FLEET}': the fleet's own nodes are.")
        for row in self.robots:
            if self.task == SWAP_PLACES and (row.start or row.goal or row.goals):
                raise ValueError(
                    f"robot '{row.called}' has a start or goal, and task '{self.task}' draws them."
                )
        check_formation(self)


def check_formation(fleet: Fleet) -> None:
    """Refuse places where there is no formation, and a formation without them.

    Raises:
        ValueError: With the robot.
    """
    if fleet.shape_error <= 0.0:
        raise ValueError(f"'shape_error' = {fleet.shape_error:g} must be greater than 0.")
    leader, *followers = fleet.robots
    for row in fleet.robots:
        if row.place and fleet.task != FORMATION:
            raise ValueError(
                f"robot '{row.called}' has a 'place', and only 'task: {FORMATION}' of the fleet has any."
            )
    if fleet.task != FORMATION:
        return
    if leader.place:
        raise ValueError(f"'{leader.called}' is the first robot and leads; it has no 'place'.")
    for row in followers:
        if not row.place:
            raise ValueError(
                f"robot '{row.called}' needs a 'place': x, y from '{leader.called}' [m], heading."
            )
        if row.start or row.goal or row.goals:
            raise ValueError(
                f"robot '{row.called}' has a start or goal, and follows '{leader.called}' at its 'place'."
            )
        if not row.keep_apart:
            raise ValueError(f"robot '{row.called}' needs 'keep_apart: true' in a formation.")


@cache
def is_fleet(name: str) -> bool:
    """Whether a file of `configs/systems` has `robots:` at its outermost level."""
    text = config_path("systems", name).read_text(encoding="utf-8", errors="replace")
    return any(line.startswith("robots:") for line in text.splitlines())


def system_names(*, fleets: bool) -> list[str]:
    """Names of `configs/systems`: fleets, or systems of one robot."""
    return [name for name in config_names("systems") if is_fleet(name) == fleets]


def load_any_system(name: str) -> System | Fleet:
    """A file of `configs/systems`, of one robot or of several. Raises as `load_fleet` and `load_system`."""
    return load_fleet(name) if is_fleet(name) else load_system(name)


def load_fleet(name: str) -> Fleet:
    """Read `configs/systems/<name>.yaml` and check that everything it names exists.

    Raises:
        ConfigError: Unknown name, a system of one robot, a mistake in the file, or robots whose starts touch.
    """
    path = config_path("systems", name)
    if not is_fleet(name):
        raise ConfigError(
            f"system '{name}' is of one robot, and no fleet. Fleets: {', '.join(system_names(fleets=True))}."
        )
    fleet = load_config(Fleet, path)
    for row in fleet.robots:
        if row.backend != "mujoco":
            raise ConfigError(
                f"{path}: robot '{row.called}' has backend '{row.backend}'; robots of a fleet share a world in mujoco. "
                "Start others with a `fulmar up` of their own."
            )
        check_names(row.robot, row.task, row.controller, row.backend)
        if row.place and load_task(row.task).goal_topic != GOAL_POSE.name:
            raise ConfigError(
                f"{path}: robot '{row.called}' has a 'place', which is a pose, and task '{row.task}'. Give go_to_pose."
            )
    if not fleet.task:
        check_starts_apart(
            {row.called: (row.robot, row.start or (0.0, 0.0, 0.0)) for row in fleet.robots}, path
        )
    return fleet


def check_starts_apart(starts: dict[str, tuple[str, tuple[float, ...]]], where: Path | str) -> None:
    """Refuse robots whose starts touch.

    Args:
        starts: Type and start of each robot [m, deg], by its name.
        where: For the message.

    Raises:
        ConfigError: The first two.
    """
    for (one, (first, at)), (other, (second, there)) in itertools.combinations(starts.items(), 2):
        apart = math.hypot(at[0] - there[0], at[1] - there[1])
        needed = load_robot(first).body.radius + load_robot(second).body.radius
        if apart <= needed:
            raise ConfigError(
                f"{where}: '{one}' and '{other}' start {apart:.2f} m apart, and their hulls reach {needed:.2f} m. Give "
                "one of them another 'start'."
            )


def drawn(fleet: Fleet, seed: int) -> dict[str, tuple[tuple[float, ...], tuple[float, ...]]]:
    """Start and goal of each robot that the fleet's task gives, by name [m, m, deg]; empty without such a task.

    Those of `swap_places` are drawn by the seed; robots of a formation start at their places about the leader.
    """
    if fleet.task == FORMATION:
        leader, *followers = fleet.robots
        x, y, _ = leader.start or (0.0, 0.0, 0.0)
        at = {row.called: (x + row.place[0], y + row.place[1], row.place[2]) for row in followers}
        return {name: (place, place) for name, place in at.items()}
    if not fleet.task:
        return {}
    radii = [load_robot(row.robot).body.radius for row in fleet.robots]
    starts, goals = (np.column_stack((p[:, :2], np.rad2deg(p[:, 2]))) for p in swap_places(seed, radii))
    return {
        row.called: (tuple(starts[i].tolist()), tuple(goals[i].tolist()))
        for i, row in enumerate(fleet.robots)
    }
