"""From what a person asked for to a complete, checked plan; nothing is started here."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any, cast

import numpy as np

from fulmar_bringup.emulation import check_emulated
from fulmar_bringup.external import adapter_path, check_external
from fulmar_bringup.goal_plan import checked_goals, duration_of, first_targets, goal_path, start_of
from fulmar_bringup.node_table import RunPlan
from fulmar_bringup.remapping import read_remappings
from fulmar_bringup.system import (
    Guards,
    check_names,
    default_control_hz,
    default_guards,
    default_hardware,
    system_of,
)
from fulmar_core.bundle_signature import verify_bundle
from fulmar_core.controllers.classical import has_law
from fulmar_core.disturbances.scenario import load_scenario
from fulmar_core.episode import draw_episode
from fulmar_core.errors import BundleError, ConfigError, UnknownNameError
from fulmar_core.estimation.motion_filter import load_estimator
from fulmar_core.goal import Goal, PoseTuple
from fulmar_core.goal_files import GoalFile
from fulmar_core.own_class import is_own
from fulmar_core.planar import PlanarState, wrapped
from fulmar_core.policy_bundle import check_fit, check_folder, read_bundle, read_passport
from fulmar_core.recording import MODES, Mode, Recording
from fulmar_core.robot import Robot, load_robot
from fulmar_core.robot_name import checked_name
from fulmar_core.safety.geofence import check_starts
from fulmar_core.safety.watchdog import default_timeout
from fulmar_core.tasks import Task, load_task
from hardware_drivers.own_driver import check_own_driver
from hardware_drivers.settings import UNARMED, MavlinkBoat, load_hardware
from policy_server.controllers import FALLBACKS, controller_entry
from policy_server.shipped import shipped_policies, shipped_policy

PLACES = ("goal_pose", "goal_point")  # goals that a person can say in one line


@dataclass(frozen=True)
class RunRequest:
    """What to run, where to go, and where to record."""

    plan: RunPlan
    goal: PoseTuple | None  # None: the task has more than one target, or none in space
    record: Path  # folder of the bag; must not exist
    command: str  # command line, for the record
    mission: Goal = field(compare=False)  # everything that the task is about; `goal` is a part of it
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
) -> RunRequest:
    """Complete a request and refuse what cannot work, before any process is started.

    Args:
        robot: Type of the robot.
        name: What the robot is called; its type by default.
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

    Returns:
        The request.

    Raises:
        ConfigError: Unknown name or impossible value.
        BundleError: The policy is damaged or made for something else.
    """
    check_names(robot, task, controller, backend)
    own_name = "" if name is None else checked_name(name)
    hardware = _checked_hardware(robot, backend, hardware, emulate=emulate, hurried=lockstep or rate != 1.0)
    check_arming(hardware, arm=arm)
    _check_finite(goal=goal, start=start, duration=duration_s, rate=rate)
    the_robot, the_task = load_robot(robot), load_task(task)
    hz = checked_rate(the_robot, control_hz or default_control_hz(robot, task, controller, backend))
    if not lockstep:
        check_beat(hz, rate)
    watched = _checked_guards(
        default_guards(controller, backend, hardware), guards, the_robot, the_task, lockstep=lockstep
    )
    check_external(controller, watched, adapter=adapter, topic=topic, lockstep=lockstep)
    _check_ours(controller, copies=copies, network=controller_network)
    policy = chosen_policy(controller, policy, the_robot, the_task, hz, fallback=watched.fallback)
    if policy is not None and watched.trusted_keys is not None:
        _check_signed(policy, Path(watched.trusted_keys), fallback=watched.fallback)
    if record.exists():
        raise ConfigError(
            f"{record} exists already; nothing recorded is overwritten. Give --record another folder."
        )
    episode = draw_episode(the_robot, the_task, load_scenario(scenario), seed=seed, number=0)
    mission, drawn_start = episode.goal, _pose_of_state(episode.start)
    if hardware and not emulate:
        start = start or (0.0, 0.0, 0.0)  # where a robot stands is where its odometry begins
        if goal is None and goals is None and not goals_later:
            raise ConfigError("a real robot goes nowhere by chance: say where with --goal or --goals.")
    if goals is not None:
        if goal is not None:
            raise ConfigError("--goals brings its own goals; it takes no --goal.")
        file = checked_goals(goals, the_robot, the_task)
        mission, drawn_start = _from_file(file, mission, drawn_start)
        duration_s = duration_s or duration_of(file, the_robot, start or drawn_start)
    elif goal is not None:
        mission, drawn_start = _moved(the_task, mission, drawn_start, goal)
    if start is None and goals is None:
        check_starts(the_robot, the_task)
    start = start or drawn_start
    if not goals_later:
        _check_distance(the_robot, the_task, mission, start)
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
        hardware=hardware,
        emulated=emulate,
        arm=arm,
        guards=watched,
        recording=_recording_of_run(controller, backend, recording),
        copies=copies,
        controller_network=controller_network,
        mocap_hz=_checked_mocap(mocap_hz, hardware, emulate=emulate, lockstep=lockstep),
        remappings=tuple(read_remappings(remap).items()),
        adapter=adapter_path(robot, adapter),
        adapter_topic=topic or "",
    )
    goal = goal or (_pose_of(mission.current) if the_task.goal_topic in PLACES else None)
    return RunRequest(plan, goal, record, command, mission)


def _checked_hardware(robot: str, backend: str, asked: str | None, *, emulate: bool, hurried: bool) -> str:
    """Path of the hardware file, empty for simulators.

    Raises:
        ConfigError: The options do not go together, or the file is wrong.
    """
    if backend != "hardware":
        if asked is not None or emulate:
            raise ConfigError(f"--hardware and --emulate go with --backend hardware, not with {backend}.")
        return ""
    if hurried:
        raise ConfigError(
            "a device neither waits nor hurries: --backend hardware takes no --lockstep and no --rate."
        )
    path = default_hardware(robot, asked)
    driver = load_hardware(path).driver
    if emulate:
        check_emulated(driver)
    check_own_driver(driver)
    return path


def _check_ours(controller: str, *, copies: int, network: str) -> None:
    """Refuse options of the controller node where an external controller runs.

    Raises:
        ConfigError: On the first one.
    """
    for option, given in (("--copies", copies > 1), ("--controller-in", bool(network))):
        if given and controller_entry(controller).is_external:
            raise ConfigError(
                f"{option} is for a controller that Fulmar starts; '{controller}' is yours. Leave it out."
            )


def check_arming(hardware: str, *, arm: bool) -> None:
    """Refuse to drive a boat that may not arm, and `--arm` where nothing is armed.

    Args:
        hardware: Hardware file; empty for simulators.
        arm: Whether `--arm` was given.

    Raises:
        ConfigError: One of the two.
    """
    file = load_hardware(hardware) if hardware else None
    if file is None or not file.arms:
        if arm:
            raise ConfigError(
                "--arm is for boats with an autopilot (driver 'mavlink_boat') and own drivers with `arm`; leave it out."
            )
    elif not (arm or getattr(file.driver, "arm", None)):
        driver, does = file.driver, "arms the device"
        if isinstance(driver, MavlinkBoat):
            channels = f"{driver.steering_channel} and {driver.throttle_channel}"
            does = f"sets MANUAL, arms the boat and overrides RC channels {channels}"
        raise ConfigError(
            f"{hardware}: {UNARMED}. Driving {does}. Write arm: true into the file, or give --arm, "
            "once the propellers are clear."
        )


def _checked_mocap(mocap_hz: float, hardware: str, *, emulate: bool, lockstep: bool) -> float:
    """The rate itself, where something simulates a motion capture.

    Raises:
        ConfigError: The robot is real, or time stands still between commands.
    """
    if mocap_hz and hardware and not emulate:
        raise ConfigError("--mocap-hz simulates a motion capture; a real robot has its own. Leave it out.")
    if mocap_hz and lockstep:
        raise ConfigError(
            "in lock step time stands still between commands, and a motion capture does not. "
            "Leave --lockstep out; --rate makes a run faster."
        )
    return mocap_hz


def _checked_guards(
    usual: Guards, asked: Mapping[str, Any], robot: Robot, task: Task, *, lockstep: bool
) -> Guards:
    """The usual guards with what was asked for, if they can do what they are for.

    Raises:
        ConfigError: A fallback that has nothing for the pair, no such estimator, or an estimator in lock step.
    """
    fallback = asked.get("fallback")
    if fallback is not None and fallback not in FALLBACKS:
        raise UnknownNameError("fallback", fallback, FALLBACKS)
    guards = replace(usual, **asked)
    if guards.fallback:
        controller_entry(guards.fallback).check(robot, task)
    if guards.estimator:
        load_estimator(guards.estimator)
        if lockstep:
            raise ConfigError(
                "an estimator needs every measurement in between, and lock step has one a command. "
                "Leave --lockstep out; --rate makes a run faster."
            )
    return guards


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
    if not (mission.obstacles.size or task.things):
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
    controller: str,
    policy: Path | None,
    robot: Robot,
    task: Task,
    control_hz: float,
    *,
    fallback: str | None = None,
) -> Path | None:
    """The bundle that a controller will run, checked; None for one that runs none.

    With a fallback a bundle that is refused stops nothing: the node refuses it too, and says why.

    Raises:
        ConfigError: A bundle was given to a controller that runs none.
        BundleError: None is shipped, or the bundle is damaged or made for something else.
    """
    if controller_entry(controller).runs_bundle:
        try:
            return checked_policy(policy, robot, task, control_hz)
        except BundleError:
            if fallback is None or policy is None:
                raise
            return policy
    if policy is not None:
        raise ConfigError(
            f"controller '{controller}' runs no policy bundle. Leave --policy out, or use --controller policy."
        )
    return None


def _check_signed(folder: Path, trusted: Path, *, fallback: str | None) -> None:
    """Refuse a bundle that the node would refuse; with a fallback only keys that nobody can read."""
    try:
        verify_bundle(read_bundle(folder), trusted)
    except BundleError:
        if fallback is None:
            raise


def checked_policy(policy: Path | None, robot: Robot, task: Task, control_hz: float) -> Path:
    """The bundle that will run, after its passport was checked.

    Raises:
        BundleError: None is shipped, or the bundle is damaged or made for something else.
    """
    folder = policy or shipped_policy(robot.name, task.name)
    if folder is None:
        otherwise = ", or use --controller classical" if has_law(robot, task) else ""
        if is_own(task.name):
            otherwise = ", or use a controller of your own: --controller mypackage.mymodule:MyController"
        raise BundleError(
            f"no policy is shipped for '{robot.name}' and '{task.name}'. Give one with --policy, "
            f"train one with `fulmar train {robot.name} {task.name}`{otherwise}."
        )
    check_folder(folder, known=sorted(shipped_policies(), key=lambda each: robot.name not in each.name))
    check_fit(read_passport(folder), robot, task, control_hz, where=str(folder))
    return folder


def _pose_of_state(state: PlanarState) -> PoseTuple:
    return _pose_of(np.array([state.x, state.y, state.yaw]))


def _pose_of(target: np.ndarray) -> PoseTuple:
    return float(target[0]), float(target[1]), math.degrees(float(wrapped(np.asarray(target[2]))))
