"""Request of a run: a complete, checked plan of what a person asked for; starts nothing."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any, cast

from fulmar_bringup.excitation_plan import excitation_of
from fulmar_bringup.goal_plan import (
    check_file_places,
    checked_goals,
    duration_of,
    first_targets,
    goal_path,
    goal_rate,
    start_of,
)
from fulmar_bringup.node_spec import NodeSpec
from fulmar_bringup.own_row import own_nodes
from fulmar_bringup.plan_checks import (
    adapter_path,
    check_arming,
    check_beat,
    check_distance,
    check_external,
    check_finite,
    check_node_options,
    check_signed,
    checked_guards,
    checked_hardware,
    checked_mocap,
    checked_rate,
    chosen_policy,
    read_remappings,
    usual_controller,
    with_usual_estimators,
)
from fulmar_bringup.run_plan import RunPlan
from fulmar_bringup.system import (
    check_names,
    default_control_hz,
    default_guards,
    system_of,
)
from fulmar_bringup.task_choice import whole_pose
from fulmar_core.config.errors import ConfigError, UnknownNameError
from fulmar_core.config.recording import MODES, Mode, Recording
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.safety.geofence import check_places, check_starts, farthest_goal, unreachable
from fulmar_core.simulation.episode import draw_episode
from fulmar_core.tasks import Task, load_task
from fulmar_core.tasks.goal import PLACES, Goal, PoseTuple
from fulmar_core.tasks.goal_files import GoalFile
from fulmar_core.tasks.torque_profiles import DURATION_S
from fulmar_core.wires.robot_name import checked_name
from fulmar_core.worlds.scenario import Scenario, load_scenario

DRAWS = 1000  # of a start and a goal, before an area counts as too small for them


@dataclass(frozen=True)
class RunRequest:
    """Plan of a run, its goal, and its bag."""

    plan: RunPlan
    goal: PoseTuple | None  # None: the task has more than one target, or none in space
    record: Path  # folder of the bag; must not exist
    command: str  # command line, for the record
    mission: Goal = field(compare=False)  # all targets and obstacles; `goal` is a part of it
    end_on_estop: bool = False  # the run ends, and fails, when an e-stop stops the robot


def plan_run(
    *,
    robot: str,
    name: str | None = None,
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
    hardware: str | None = None,
    emulate: bool = False,
    arm: bool = False,
    guards: Mapping[str, Any] = MappingProxyType({}),
    recording: str | None = None,
    copies: int = 1,
    controller_network: str = "",
    mocap_hz: float = 0.0,
    remap: Sequence[str] = (),
    adapter: str | None = None,
    topic: str | None = None,
    goals_later: bool = False,
    extras: Sequence[str] = (),
) -> RunRequest:
    """Complete a request and refuse what cannot work, before any process is started.

    Args:
        robot: Type of the robot.
        name: What the robot is called; its type by default.
        task: Name of the task.
        controller: Name of the controller.
        backend: Name of the backend.
        policy: Bundle; the shipped one by default.
        goal: As `State.NUMBERS` of the robot, angles are 0 by default [m, deg]; drawn from the seed by default, always
            so for tasks with other goals.
        start: Same; by default as far from the goal as the seed's episode begins. With obstacles, these and the start
            stay where the seed has put them.
        duration_s: Simulated time; the task's episode by default [s].
        lockstep: Whether plant and controller wait for each other.
        rate: Simulated seconds a wall-clock second.
        control_hz: Command rate; the system file's by default [Hz].
        scenario: Name of the scenario.
        seed: Seed.
        record: Folder of the bag; must not exist.
        command: Command line.
        goals: Goal file, a name or a path that ends in `.yaml`; its goals come one after another.
        hardware: Hardware file, a name or a path that ends in `.yaml`; the robot's own by default.
        emulate: Whether an emulator stands in for the device.
        arm: Whether an autopilot may be armed that the hardware file does not arm.
        guards: What replaces the guards of the system file, by name.
        recording: `whole` or `ring`; the system file's by default.
        copies: How often each command is sent.
        controller_network: Network namespace that the controller runs in; ours by default.
        mocap_hz: Rate of a simulated motion capture beside the odometry; 0: none [Hz].
        remap: Topics under other names, each `FROM:=TO`.
        adapter: With controller `external`, name or path of the hardware file whose commands it speaks.
        topic: Topic that the adapter takes them from; the file's by default.
        goals_later: Whether goals come from outside while the system runs; `goal` and `goals` are None then.
        extras: Optional nodes of the table that run; none in lock step, where every message counts.

    Returns:
        The request.

    Raises:
        ConfigError: Unknown name or impossible value.
        BundleError: The policy is damaged or made for something else.
    """
    if lockstep and rate != 1.0:
        raise ConfigError("--lockstep runs as fast as it goes; it takes no --rate.")
    if lockstep and extras:
        raise ConfigError(
            f"--lockstep gives the same bytes each time; it takes no --{extras[0]}, which goes by the clock."
        )
    controller = usual_controller(controller, policy, load_robot(robot), load_task(task))
    check_names(robot, task, controller, backend, hardware)
    own_name = "" if name is None else checked_name(name)
    hardware = checked_hardware(robot, backend, hardware, emulate=emulate, hurried=lockstep or rate != 1.0)
    check_arming(hardware, arm=arm)
    check_finite(goal=goal, start=start, duration=duration_s, rate=rate)
    the_robot, the_task = load_robot(robot), load_task(task)
    goal = goal and whole_pose(goal, the_robot, "--goal")
    start = start and whole_pose(start, the_robot, "--start")
    hz = checked_rate(the_robot, control_hz or default_control_hz(robot, task, controller, backend, policy))
    if not lockstep:
        check_beat(hz, rate)
    watched = checked_guards(default_guards(controller, backend, hardware), guards, the_robot, the_task)
    watched = with_usual_estimators(watched, the_robot, load_scenario(scenario), backend)
    check_external(controller, watched, adapter=adapter, topic=topic, lockstep=lockstep)
    check_node_options(controller, copies=copies, network=controller_network)
    policy = chosen_policy(controller, policy, the_robot, the_task, hz, fallback=watched.fallback)
    if policy is not None and watched.trusted_keys is not None:
        check_signed(policy, Path(watched.trusted_keys), fallback=watched.fallback)
    if record.exists():
        raise ConfigError(
            f"{record} exists already; nothing recorded is overwritten. Give --record another folder."
        )
    there = next(folder for folder in record.absolute().parents if folder.exists())
    if there.is_dir() and not os.access(there, os.W_OK | os.X_OK):
        raise ConfigError(
            f"{record}: cannot write a bag in {there}: Permission denied. Name a folder that you may write."
        )
    if hardware and not emulate:
        # Where a robot stands is where its odometry begins.
        start = start or whole_pose((0.0,) * the_robot.state_type.AXES, the_robot, "--start")
        # References of aircraft begin where the craft is, and no single goal holds one.
        if goal is None and goals is None and not goals_later and the_robot.kind.stops:
            raise ConfigError("a real robot goes nowhere by chance: say where with --goal or --goals.")
    if goals is not None and goal is not None:
        raise ConfigError("--goals brings its own goals; it takes no --goal.")
    excitation = excitation_of(goals, the_robot, controller)
    if excitation:
        goals, duration_s = None, duration_s or DURATION_S
    file = (
        None if goals is None else checked_goals(goals, the_robot, the_task, goal_rate(hz, lockstep=lockstep))
    )
    if file is not None:
        check_file_places(file, goals or "", the_robot, watched.area)
    mission, drawn_start = _placed(
        the_robot,
        the_task,
        load_scenario(scenario),
        seed,
        file=file,
        goal=goal,
        start=start,
        area=watched.area,
        checks_goal=not goals_later,
        checks_start=not hardware or emulate,
    )
    if file is not None:
        duration_s = duration_s or duration_of(file, the_robot, start or drawn_start)
    if start is None and goals is None:
        check_starts(the_robot, the_task)
    start = start or drawn_start
    if not goals_later:
        check_distance(the_robot, the_task, mission, start)
    nodes = _own_nodes(robot, task, controller, backend, own_name)
    plan = RunPlan(
        robot=robot,
        task=task,
        controller=controller,
        backend=backend,
        control_hz=hz,
        name=own_name,
        policy=str(policy.absolute()) if policy else "",
        scenario=scenario,
        seed=seed,
        start=start,
        duration_s=duration_s or the_task.episode_s,
        lockstep=lockstep,
        rate=rate,
        goals=str(goal_path(goals)) if goals else "",
        excitation=excitation,
        hardware=hardware,
        emulated=emulate,
        arm=arm,
        guards=watched,
        recording=_recording_of_run(controller, backend, recording),
        copies=copies,
        controller_network=controller_network,
        mocap_hz=checked_mocap(
            mocap_hz, hardware, emulate=emulate, lockstep=lockstep, estimated=bool(watched.estimator or nodes)
        ),
        remappings=tuple(read_remappings(remap).items()),
        adapter=adapter_path(robot, adapter),
        adapter_topic=topic or "",
        nodes=nodes,
        extras=tuple(extras),
    )
    goal = goal or (the_task.state_type.written(mission.current) if the_task.goal_topic in PLACES else None)
    return RunRequest(plan, goal, record, command, mission)


def _placed(
    robot: Robot,
    task: Task,
    scenario: Scenario,
    seed: int,
    *,
    file: GoalFile | None,
    goal: PoseTuple | None,
    start: PoseTuple | None,
    area: Sequence[float],
    checks_goal: bool,
    checks_start: bool,
) -> tuple[Goal, PoseTuple]:
    """The goal and the start of a run, both inside the area; what was not given is drawn until it is.

    The first draw is the seed's episode. It stays where the task has obstacles or things: the plant draws the
    same ones.

    Args:
        robot: The robot.
        task: The task.
        scenario: Scenario of the draws.
        seed: Seed of the draws.
        file: Goals from a file, which were checked.
        goal: The goal that was given.
        start: The start that was given.
        area: Area of the robot.
        checks_goal: Whether the robot goes to the goal by itself; otherwise goals come later.
        checks_start: Whether the start is known; a real robot starts where it stands.

    Raises:
        ConfigError: What was given is outside, or no draw is inside.
    """
    farthest = farthest_goal(robot)
    if goal is not None:
        check_places(
            "the goal", [goal], area, farthest
        )  # numbers of a pose, of which a place is at the front
    if start is not None and checks_start:
        check_places("the start", [start], area, farthest)
    fixed = start_of(file) if file is not None else None
    if fixed is not None and start is None and checks_start:
        check_places("the start of these goals", [fixed], area, farthest)
    for number in range(DRAWS):
        episode = draw_episode(robot, task, scenario, seed=seed, number=number)
        mission, drawn = episode.goal, task.state_type.written(episode.start.pose)
        if file is not None:
            mission, drawn = _from_file(file, mission, drawn)
        elif goal is not None:
            mission, drawn = _moved(task, mission, drawn, goal)
        targets = mission.targets.tolist() if checks_goal and task.goal_topic != "goal_velocity" else []
        starts = [start or drawn] if checks_start else []
        problem = unreachable("the drawn goal", targets, area, farthest) or unreachable(
            "the drawn start", starts, area, farthest
        )
        if not problem:
            return mission, drawn
        if mission.obstacles.size or task.things:
            break
    raise ConfigError(f"{problem} Give --start and --goal, another --seed, or a larger area.")


def _from_file(file: GoalFile, drawn: Goal, start: PoseTuple) -> tuple[Goal, PoseTuple]:
    """The first goal of a file, and a start that suits it."""
    mission = replace(drawn, targets=first_targets(file))
    fixed = start_of(file)
    if fixed is not None:
        return mission, fixed
    axes = file.form.AXES
    way = (mission.current[:axes] - drawn.current[:axes]).tolist()
    return mission, (*(s + w for s, w in zip(start, way, strict=False)), *start[axes:])


def _moved(task: Task, mission: Goal, start: PoseTuple, goal: PoseTuple) -> tuple[Goal, PoseTuple]:
    """Put another target into a drawn mission, and move the start along where there are no obstacles or things.

    Raises:
        ConfigError: The task has no single target in space.
    """
    if task.goal_topic not in PLACES:
        raise ConfigError(
            f"the targets of task '{task.name}' do not fit into one --goal. Leave it out: --seed draws them. "
            "Or publish your own while a system runs."
        )
    form, old = task.state_type, mission.current.tolist()
    if not (mission.obstacles.size or task.things):
        place = (g + s - o for g, s, o in zip(goal[: form.AXES], start, old, strict=False))
        start = (*place, *start[form.AXES :])
    return replace(mission, targets=form.target_at(goal)[None]), start


def chosen_recording(usual: Recording, mode: str | None) -> Recording:
    """How to record, in another mode than usual where one is given.

    Raises:
        ConfigError: There is no such mode.
    """
    if mode is None:
        return usual
    if mode not in MODES:
        raise UnknownNameError("recording", mode, MODES)
    return replace(usual, mode=cast(Mode, mode))


def _own_nodes(robot: str, task: str, controller: str, backend: str, name: str) -> tuple[NodeSpec, ...]:
    """The nodes of its own that the matching system file names, if it is of the same robot and task."""
    system = system_of(controller, backend)
    if system is None or (system.robot, system.task) != (robot, task):
        return ()
    return own_nodes(replace(system, name=name))


def _recording_of_run(controller: str, backend: str, mode: str | None) -> Recording:
    """How the matching system file records, or as asked; a run has one bag.

    Raises:
        ConfigError: There is no such mode, or it makes several bags.
    """
    system = system_of(controller, backend)
    usual = system.recorder if system else Recording()
    if usual.mode == "goals":
        usual = replace(usual, mode="whole")
    chosen = chosen_recording(usual, mode)
    if chosen.mode == "goals":
        raise ConfigError("a run has one bag: --recording goals is for `fulmar up`. Leave it out.")
    return chosen
