"""From what a person asked for to a complete, checked plan; nothing is started here."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import cast

import numpy as np

from fulmar_bringup.goal_plan import checked_goals, duration_of, first_targets, goal_path, start_of
from fulmar_bringup.node_table import RunPlan
from fulmar_bringup.system import check_names, default_control_hz, system_of
from fulmar_core.disturbances.scenario import load_scenario
from fulmar_core.episode import draw_episode
from fulmar_core.errors import BundleError, ConfigError, UnknownNameError
from fulmar_core.goal import Goal
from fulmar_core.goal_files import GoalFile
from fulmar_core.planar import PlanarState, wrapped
from fulmar_core.policy_bundle import check_fit, read_passport
from fulmar_core.recording import MODES, Mode, Recording
from fulmar_core.robot import Robot, load_robot
from fulmar_core.safety.watchdog import default_timeout
from fulmar_core.tasks import Task, load_task
from policy_server.shipped import shipped_policy

PoseTuple = tuple[float, float, float]  # x [m], y [m], heading [deg]
PLACES = ("goal_pose", "goal_point")  # goals that a person can say in one line


@dataclass(frozen=True)
class RunRequest:
    """What to run, where to go, and where to record."""

    plan: RunPlan
    goal: PoseTuple | None  # None: the task has more than one target, or none in space
    record: Path  # folder of the bag; must not exist
    command: str  # command line, for the record
    mission: Goal = field(compare=False)  # everything that the task is about; `goal` is a part of it


def plan_run(
    *,
    robot: str,
    task: str,
    controller: str,
    backend: str,
    policy: Path | None,
    goal: PoseTuple | None,
    start: PoseTuple | None,
    duration_s: float | None,
    lockstep: bool,
    rate: float,
    control_hz: float | None,
    scenario: str,
    seed: int,
    record: Path,
    command: str,
    goals: str | None = None,
    recording: str | None = None,
) -> RunRequest:
    """Complete a request and refuse what cannot work, before any process is started.

    Args:
        robot: Name of the robot.
        task: Name of the task.
        controller: Name of the controller.
        backend: Name of the backend.
        policy: Bundle; the shipped one by default.
        goal: x [m], y [m], heading [deg]; drawn from the seed by default, always so for tasks with other goals.
        start: Same; by default as far from the goal as the seed's episode begins. Where something stands about, it
            stays where the seed has put it, and so does the start.
        duration_s: Simulated time; the task's episode by default [s].
        lockstep: Whether plant and controller wait for each other.
        rate: Simulated seconds a wall-clock second.
        control_hz: Command rate; the system file's by default [Hz].
        scenario: Name of the scenario.
        seed: Seed.
        record: Folder of the bag; must not exist.
        command: Command line.
        goals: Goal file, a name or a path that ends in `.yaml`; its goals come one after another.
        recording: `whole` or `ring`; the system file's by default.

    Returns:
        The request.

    Raises:
        ConfigError: Unknown name or impossible value.
        BundleError: The policy is damaged or made for something else.
    """
    check_names(robot, task, controller, backend)
    _check_finite(goal=goal, start=start, duration=duration_s, rate=rate)
    the_robot, the_task = load_robot(robot), load_task(task)
    hz = checked_rate(the_robot, control_hz or default_control_hz(robot, task, controller, backend))
    if not lockstep:
        check_beat(hz, rate)
    policy = chosen_policy(controller, policy, the_robot, the_task, hz)
    if record.exists():
        raise ConfigError(
            f"{record} exists already; nothing recorded is overwritten. Give --record another folder."
        )
    episode = draw_episode(the_robot, the_task, load_scenario(scenario), seed=seed, number=0)
    mission, drawn_start = episode.goal, _pose_of_state(episode.start)
    if goals is not None:
        if goal is not None:
            raise ConfigError("--goals brings its own goals; it takes no --goal.")
        file = checked_goals(goals, the_robot, the_task)
        mission, drawn_start = _from_file(file, mission, drawn_start)
        duration_s = duration_s or duration_of(file, the_robot, start or drawn_start)
    elif goal is not None:
        mission, drawn_start = _moved(the_task, mission, drawn_start, goal)
    start = start or drawn_start
    _check_distance(the_robot, the_task, mission, start)
    plan = RunPlan(
        robot=robot,
        task=task,
        controller=controller,
        backend=backend,
        control_hz=hz,
        policy=str(policy.absolute()) if policy else "",
        scenario=scenario,
        seed=seed,
        start=start,
        duration_s=duration_s or the_task.episode_s,
        lockstep=lockstep,
        rate=rate,
        goals=str(goal_path(goals)) if goals else "",
        recording=chosen_recording(controller, backend, recording),
    )
    goal = goal or (_pose_of(mission.current) if the_task.goal_topic in PLACES else None)
    return RunRequest(plan, goal, record, command, mission)


def default_task(robot: str) -> str:
    """What a robot does if nobody says: the hardest of the plain tasks that its own policy can."""
    return "go_to_pose" if shipped_policy(robot, "go_to_pose") else "go_to_position"


def _from_file(file: GoalFile, drawn: Goal, start: PoseTuple) -> tuple[Goal, PoseTuple]:
    """The first goal of a file, and a start that suits it."""
    mission = replace(drawn, targets=first_targets(file))
    fixed = start_of(file)
    if fixed is not None:
        return mission, fixed
    x, y = (float(new - old) for new, old in zip(mission.current[:2], drawn.current[:2], strict=True))
    return mission, (start[0] + x, start[1] + y, start[2])


def _moved(task: Task, mission: Goal, start: PoseTuple, goal: PoseTuple) -> tuple[Goal, PoseTuple]:
    """Put another target into a drawn mission, and move the start along where nothing stands about.

    Raises:
        ConfigError: The task has no single target in space.
    """
    if task.goal_topic not in PLACES:
        raise ConfigError(
            f"the targets of task '{task.name}' cannot be said in one --goal. Leave it out: --seed draws them. "
            "Or publish your own while a system runs."
        )
    x, y, heading = goal
    target = np.array([[x, y, math.radians(heading)]])
    if not (mission.obstacles.size or mission.block.any()):
        old = mission.current
        start = (x + start[0] - float(old[0]), y + start[1] - float(old[1]), start[2])
    return replace(mission, targets=target), start


def _check_distance(robot: Robot, task: Task, mission: Goal, start: PoseTuple) -> None:
    """Refuse a start beyond the geofence around the first target, and targets as far from each other.

    Raises:
        ConfigError: If it is.
    """
    if task.goal_topic == "goal_velocity":
        return
    places = [np.asarray(start[:2]), *mission.targets[:, :2]]
    for number, (here, there) in enumerate(itertools.pairwise(places)):
        distance = math.dist(here, there)
        if distance > robot.limits.geofence:
            what = f"targets {number} and {number + 1}" if number else "start and goal"
            raise ConfigError(
                f"{what} are {distance:.1f} m apart, the geofence of '{robot.name}' is "
                f"{robot.limits.geofence:g} m. Bring them nearer to each other."
            )


def _check_finite(**values: PoseTuple | float | None) -> None:
    for name, value in values.items():
        if value is not None and not np.isfinite(value).all():
            raise ConfigError(f"{name} = {value} must be finite.")


def checked_rate(robot: Robot, control_hz: float) -> float:
    """The rate itself, if the physics can keep it.

    Raises:
        ConfigError: If the control period is no multiple of the physics step.
    """
    try:
        robot.timing.substeps(control_hz)
    except ValueError as error:
        raise ConfigError(f"robot '{robot.name}': {error}") from error
    return control_hz


def chosen_recording(controller: str, backend: str, mode: str | None) -> Recording:
    """What the system file says of the recorder, in another mode where one is given.

    Raises:
        ConfigError: There is no such mode.
    """
    system = system_of(controller, backend)
    recording = system.recorder if system else Recording()
    if mode is None:
        return recording
    if mode not in MODES:
        raise UnknownNameError("recording", mode, MODES)
    return replace(recording, mode=cast(Mode, mode))


def check_beat(control_hz: float, rate: float) -> None:
    """Refuse commands so rare that the plant's watchdog would trip between any two of them, in real time.

    Args:
        control_hz: Command rate, in simulated time [Hz].
        rate: Simulated seconds a wall-clock second.

    Raises:
        ConfigError: If the control period is not shorter than the watchdog's timeout.
    """
    period_s, timeout_s = 1.0 / (control_hz * rate), default_timeout(1.0 / control_hz) / min(rate, 1.0)
    if period_s >= timeout_s:
        raise ConfigError(
            f"control_hz = {control_hz:g} at rate {rate:g} gives a command every {1e3 * period_s:.0f} ms of wall-clock "
            f"time, but the watchdog closes the actuators after {1e3 * timeout_s:.0f} ms without one. "
            "Raise --control-hz, or use --lockstep."
        )


def chosen_policy(
    controller: str, policy: Path | None, robot: Robot, task: Task, control_hz: float
) -> Path | None:
    """The bundle that a controller will run, checked; None for one that runs none.

    Raises:
        ConfigError: A bundle was given to a controller that runs none.
        BundleError: None is shipped, or the bundle is damaged or made for something else.
    """
    if controller == "policy":
        return checked_policy(policy, robot, task, control_hz)
    if policy is not None:
        raise ConfigError(
            f"controller '{controller}' runs no policy bundle. Leave --policy out, or use --controller policy."
        )
    return None


def checked_policy(policy: Path | None, robot: Robot, task: Task, control_hz: float) -> Path:
    """The bundle that will run, after its passport was checked.

    Raises:
        BundleError: None is shipped, or the bundle is damaged or made for something else.
    """
    folder = policy or shipped_policy(robot.name, task.name)
    if folder is None:
        raise BundleError(
            f"no policy is shipped for '{robot.name}' and '{task.name}'. "
            f"Train one with `fulmar train {robot.name} {task.name}`, or use --controller classical."
        )
    check_fit(read_passport(folder), robot, task, control_hz, where=str(folder))
    return folder


def _pose_of_state(state: PlanarState) -> PoseTuple:
    return _pose_of(np.array([state.x, state.y, state.yaw]))


def _pose_of(target: np.ndarray) -> PoseTuple:
    return float(target[0]), float(target[1]), math.degrees(float(wrapped(np.asarray(target[2]))))
