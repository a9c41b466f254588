"""Completes a plan: defaults come from a system file, the robot's kind, the goal file and the seed."""

from __future__ import annotations

import contextlib
from dataclasses import asdict, replace
from pathlib import Path
from typing import cast

import numpy as np

from fulmar_bringup.camera_row import CAMERA
from fulmar_bringup.excitation_plan import excitation_of
from fulmar_bringup.goal_plan import (
    check_file_places,
    checked_goals,
    duration_of,
    goal_path,
    goal_rate,
    start_of,
)
from fulmar_bringup.own_row import own_nodes
from fulmar_bringup.placement import placed
from fulmar_bringup.plan_checks import adapter_path
from fulmar_bringup.run_plan import RunPlan
from fulmar_bringup.system import (
    NONE,
    Guards,
    check_names,
    default_control_hz,
    default_guards,
    default_hardware,
    system_of,
)
from fulmar_bringup.task_choice import task_of
from fulmar_core.config.errors import BundleError, ConfigError, UnknownNameError
from fulmar_core.config.own_class import is_own
from fulmar_core.config.recording import MODES, Mode, Recording
from fulmar_core.estimators.kinds import default_estimator, estimator_kind
from fulmar_core.loop.policy_bundle import read_passport
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import ODOMETRY
from fulmar_core.safety.geofence import check_starts
from fulmar_core.tasks import Task
from fulmar_core.tasks.goal import PLACES
from fulmar_core.tasks.goal_numbers import GOAL, START, whole_pose
from fulmar_core.tasks.torque_profiles import DURATION_S
from fulmar_core.worlds.by_kind import check_scenario
from fulmar_core.worlds.scenario import load_scenario
from policy_server.controllers import controller_entry, shipped_policy, usual_controller

EVENT_RATE = "event_rate"  # file of configs/estimators that takes the place of a dead gyroscope


def completed(plan: RunPlan) -> RunPlan:
    """The plan with all that was not said; a complete plan stays as it is.

    Raises:
        ConfigError: Unknown name, a mistake in a file, or choices that exclude one another: nothing completes them.
    """
    if plan.mission is not None:
        return plan
    plan = replace(plan, task=task_of(plan))
    robot = load_robot(plan.robot)
    _check_asked(plan, robot)
    task = plan.asked_task
    plan = replace(
        plan, thing=task.thing, controller=plan.controller or usual_controller(robot, task, plan.policy)
    )
    check_names(plan.robot, task, plan.controller, plan.backend, plan.hardware or None)
    policy = Path(plan.policy) if plan.policy else None
    if policy is None and controller_entry(plan.controller).runs_bundle:
        policy = shipped_policy(plan.robot, plan.task)
    hz = plan.control_hz or default_control_hz(plan.robot, plan.task, plan.controller, plan.backend, policy)
    if plan.backend == "hardware":
        plan = replace(plan, hardware=default_hardware(plan.robot, plan.hardware or None))
    plan = replace(
        plan,
        control_hz=hz,
        policy=str(policy.absolute()) if policy else "",
        adapter=adapter_path(plan.robot, plan.adapter),
        guards=_guards(plan, robot),
        extras=tuple(dict.fromkeys((*plan.extras, *_eyes(plan, policy)))),
    )
    # A controller of one's own may read the gyroscope too.
    check_scenario(robot, plan.scenario, estimated=bool(plan.guards.files) or is_own(plan.controller))
    return _with_goal(_as_its_system(plan), robot, task)


def _eyes(plan: RunPlan, policy: Path | None) -> tuple[str, ...]:
    """The simulated camera, where a policy needs its images; a real robot has its own."""
    if policy is None or plan.backend == "hardware":
        return ()
    with contextlib.suppress(BundleError):  # whatever loads the bundle says what is wrong with it
        return (CAMERA,) if read_passport(policy).image is not None else ()
    return ()


def _check_asked(plan: RunPlan, robot: Robot) -> None:
    """Refuse numbers that are none, and choices that exclude one another."""
    if plan.backend != "hardware" and (plan.hardware or plan.emulated):
        raise ConfigError(f"--hardware and --emulate go with --backend hardware, not with {plan.backend}.")
    asked = {"goal": plan.goal, "start": plan.start, "duration": plan.duration_s, "rate": plan.rate}
    asked |= {"height": plan.height, "velocity": plan.velocity}
    for name, value in asked.items():
        if value is not None and not np.isfinite(value).all():
            raise ConfigError(f"{name} = {value} must be finite.")
    given = {"--goal": plan.goal is not None, "--velocity": bool(plan.velocity), "--goals": bool(plan.goals)}
    several = [option for option, is_given in given.items() if is_given]
    if plan.goals and len(several) > 1:
        raise ConfigError(f"--goals brings its own goals; it takes no {several[0]}.")
    if len(several) > 1:
        raise ConfigError(f"{' and '.join(several)} are two goals. Give one of them.")
    # References of aircraft begin where the craft is, and no single goal holds one.
    if plan.is_real and robot.kind.stays and not (several or plan.standing):
        raise ConfigError("a real robot goes nowhere by chance: say where with --goal or --goals.")


def _guards(plan: RunPlan, robot: Robot) -> Guards:
    """The guards of the matching system file, with what was asked for and what the robot's kind always has."""
    asked = {key: value for key, value in asdict(plan.guards).items() if value != getattr(NONE, key)}
    files = [file.strip() for file in str(asked.pop("estimator", "")).split(",") if file.strip()]
    rest = tuple(file for file in files if ODOMETRY not in estimator_kind(file).publishes)
    first = [file for file in files if file not in rest]
    if len(first) > 1:
        raise ConfigError(
            f"{' and '.join(first)} estimate the odometry, and a controller follows one. Leave one out."
        )
    asked |= ({"estimator": first[0]} if first else {}) | ({"estimators": rest} if rest else {})
    guards = replace(default_guards(plan.controller, plan.backend, plan.hardware), **asked)
    guards = replace(guards, estop=guards.estop or plan.unattended)
    if not robot.kind.always_estimated or plan.backend == "hardware":
        return guards
    if guards.estimator is None:
        guards = replace(guards, estimator=default_estimator(robot))
    lost = load_scenario(plan.scenario).sensing.gyroscope_dies_s is not None and robot.event_cameras
    if lost and not any(estimator_kind(file).takes.get("events") for file in guards.estimators):
        guards = replace(guards, estimators=(*guards.estimators, EVENT_RATE))
    return guards


def _as_its_system(plan: RunPlan) -> RunPlan:
    """The plan of a run with recorder and own nodes of the matching system file; a standing system has brought its own.

    Raises:
        ConfigError: There is no such mode of recording.
    """
    if not plan.standing:
        system = system_of(plan.controller, plan.backend)
        recording = system.recorder if system is not None else Recording()
        if recording.mode == "goals":
            recording = replace(recording, mode="whole")  # a run has one bag
        same = system is not None and (system.robot, system.task) == (plan.robot, plan.task)
        nodes = own_nodes(replace(system, name=plan.name)) if system is not None and same else ()
        seen = (CAMERA,) if system is not None and same and system.camera else ()
        extras = tuple(dict.fromkeys((*plan.extras, *seen)))
        origin = plan.origin or (system.origin if system is not None and same else ())
        plan = replace(plan, recording=recording, nodes=nodes, extras=extras, origin=origin)
    if not plan.recording_mode:
        return plan
    if plan.recording_mode not in MODES:
        raise UnknownNameError("recording", plan.recording_mode, MODES)
    return replace(plan, recording=replace(plan.recording, mode=cast(Mode, plan.recording_mode)))


def _with_goal(plan: RunPlan, robot: Robot, task: Task) -> RunPlan:
    """The plan with start, goal and length, as given, as a goal file says, or as the seed draws them."""
    form = robot.state_type
    goal = plan.goal and whole_pose(plan.goal, robot, GOAL)
    start = plan.start and whole_pose(plan.start, robot, START)
    # Where a robot stands is where its odometry begins; what cannot stop begins in the air.
    if plan.is_real or (plan.standing and robot.kind.stays):
        start = start or (0.0,) * len(form.NUMBERS)
    excitation = plan.excitation or excitation_of(plan.goals, robot, plan.controller)
    goals = "" if excitation else plan.goals
    file = None
    if goals:
        file = checked_goals(goals, robot, task, goal_rate(plan.control_hz, lockstep=plan.lockstep))
        check_file_places(file, goals, robot, plan.guards.area)
    if not start and not goals:
        check_starts(robot, task)
    mission, drawn = placed(replace(plan, goal=goal, start=start), file, task)
    start_drawn, start = not start, start or drawn
    usual_s = (
        DURATION_S if excitation else duration_of(file, robot, start) if file else task.episode_of(robot)
    )
    return replace(
        plan,
        start=start,
        start_drawn=start_drawn and (file is None or start_of(file) is None),
        goal=goal or (form.written(mission.current) if task.goal_topic in PLACES else None),
        goals=str(goal_path(goals)) if goals else "",
        excitation=excitation,
        duration_s=0.0 if plan.standing else plan.duration_s or usual_s,
        mission=mission,
    )
