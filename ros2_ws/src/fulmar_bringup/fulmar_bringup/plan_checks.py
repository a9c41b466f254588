"""Checks of a complete plan, before any process is started."""

from __future__ import annotations

import itertools
import math
import os
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from fulmar_bringup.emulation import check_emulated
from fulmar_bringup.estimator_row import camera_specs
from fulmar_bringup.extra_checks import check_extras
from fulmar_bringup.lockstep_chain import chain_of
from fulmar_bringup.node_spec import CONTROLLER, PARTS
from fulmar_bringup.node_table import IN_LOCKSTEP
from fulmar_bringup.renderer_check import check_renderer
from fulmar_bringup.run_plan import RunPlan
from fulmar_bringup.system import Guards, default_hardware
from fulmar_core.config.errors import BundleError, ConfigError, UnknownNameError
from fulmar_core.config.own_class import is_own
from fulmar_core.config.paths import config_names
from fulmar_core.controllers.classical import has_law
from fulmar_core.estimators.kinds import check_estimator
from fulmar_core.loop.bundle_signature import verify_bundle
from fulmar_core.loop.envelope import check_guard
from fulmar_core.loop.policy_bundle import check_fit, check_folder, read_bundle, read_passport
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.sensors.catalogue import catalogue_path
from fulmar_core.robots.topics import COMMAND, MOCAP, SENSOR_WIRES, TRUTH, VELOCITY_COMMAND
from fulmar_core.safety.geofence import NO_AREA, check_area_of
from fulmar_core.tasks import Task, load_task
from fulmar_core.wires.silence import default_timeout
from fulmar_core.worlds.link import check_chain
from fulmar_core.worlds.scenario import load_scenario
from hardware_drivers.hardware import TOPIC_DRIVERS, load_hardware
from hardware_drivers.own_driver import check_own_driver
from hardware_drivers.settings import UNARMED, MavlinkBoat
from policy_server.controllers import EXTERNAL, controller_entry, shipped_policies, shipped_policy

# Topics between plant, controller and estimator. Goals, e-stop and status keep their names: the run itself and every
# other command of `fulmar` use them.
REMAPPABLE = tuple(wire.name for wire in (MOCAP, *SENSOR_WIRES.values(), TRUTH, COMMAND, VELOCITY_COMMAND))
NOMINAL = "nominal"  # the scenario without disturbances
TOPIC = re.compile(r"/?[A-Za-z][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*")


def checked(plan: RunPlan) -> RunPlan:
    """The complete plan itself, if it can work.

    Raises:
        ConfigError: It cannot, or a part of it would have no effect.
        BundleError: The policy is damaged or made for something else.
    """
    robot, task = load_robot(plan.robot), load_task(plan.task, plan.thing)
    _check_surroundings(plan, robot)
    check_renderer(plan, robot)
    checked_rate(robot, plan.control_hz)
    _check_pace(plan)
    _check_device(plan)
    _check_guards(plan, robot, task)
    _check_external(plan)
    _check_parts(plan)
    asked = Path(plan.policy) if plan.policy else None
    policy = chosen_policy(
        plan.controller, asked, robot, task, plan.control_hz, fallback=plan.guards.fallback
    )
    if policy is not None and plan.guards.trusted_keys is not None:
        check_signed(policy, Path(plan.guards.trusted_keys), fallback=plan.guards.fallback)
    _check_recording(plan, task)
    check_extras(plan, task)
    if not plan.standing:
        _check_distance(plan, robot, task)
    return plan


def _check_surroundings(plan: RunPlan, robot: Robot) -> None:
    """Refuse a scenario of a real robot, and cameras that would look at stars which are not installed."""
    if plan.is_real and plan.scenario != NOMINAL:
        raise ConfigError(
            f"--scenario {plan.scenario} disturbs simulations and emulated devices; a real robot has its own "
            "surroundings. Leave it out, or add --emulate."
        )
    check_chain(load_scenario(plan.scenario).link, chain_of(plan))
    if camera_specs(plan) and catalogue_path() is None:
        raise ConfigError(
            f"the simulated event cameras of '{robot.name}' look at the stars, and the star catalogue is not "
            "installed. Run: fulmar install-stars"
        )


def _check_pace(plan: RunPlan) -> None:
    """Refuse what no clock, and what lock step, cannot do; and a watchdog that would trip between any two commands."""
    if plan.lockstep and plan.rate != 1.0:
        raise ConfigError("--lockstep runs as fast as it goes; it takes no --rate.")
    by_the_clock = [name for name in plan.extras if name not in IN_LOCKSTEP]
    if plan.lockstep and by_the_clock:
        raise ConfigError(
            f"--lockstep gives the same bytes each time; it takes no "
            f"--{by_the_clock[0].replace('_', '-')}, which goes by the clock."
        )
    if plan.mocap_hz and plan.is_real:
        raise ConfigError("--mocap-hz simulates a motion capture; a real robot has its own. Leave it out.")
    if plan.mocap_hz and plan.lockstep and not (plan.guards.estimator or plan.nodes):
        raise ConfigError(
            "in lock step the plant publishes poses for an estimator only. Add --estimator, or leave --lockstep out; "
            "--rate makes a run faster."
        )
    if plan.lockstep:
        return
    hz, rate = plan.control_hz, plan.rate
    period_s, timeout_s = 1.0 / (hz * rate), default_timeout(1.0 / hz) / min(rate, 1.0)
    if period_s >= timeout_s:
        raise ConfigError(
            f"control_hz = {hz:g} at rate {rate:g} gives a command every {1e3 * period_s:.0f} ms of wall-clock "
            f"time, but the watchdog closes the actuators after {1e3 * timeout_s:.0f} ms without one. "
            "Raise --control-hz, or use --lockstep."
        )


def _check_device(plan: RunPlan) -> None:
    """Refuse a device that is not in real time, that nothing stands in for, or that may not arm."""
    if plan.unattended and plan.arm:
        raise ConfigError(
            "--service and --arm exclude one another: a person arms, beside the robot, by `fulmar up --arm`."
        )
    file = load_hardware(plan.hardware) if plan.hardware else None
    if file is not None:
        if plan.lockstep or plan.rate != 1.0:
            raise ConfigError(
                "a device runs in real time: --backend hardware takes no --lockstep and no --rate."
            )
        if plan.emulated:
            check_emulated(file.driver)
        check_own_driver(file.driver)
    check_arming(plan.hardware, arm=plan.arm)


def check_arming(hardware: str, *, arm: bool) -> None:
    """Raise ConfigError for a boat that may not arm, and for `--arm` where nothing is armed.

    The hardware file is empty for simulators.
    """
    file = load_hardware(hardware) if hardware else None
    if file is None or not file.arms:
        if arm:
            raise ConfigError(
                "--arm is for autopilots (drivers 'mavlink_boat', 'mavlink_plane', 'px4_thrusters', 'px4_wing') and "
                "own drivers with `arm`; leave it out."
            )
    elif not (arm or getattr(file.driver, "arm", None)):
        driver, does = file.driver, file.driver.arming
        if isinstance(driver, MavlinkBoat):
            channels = f"{driver.steering_channel} and {driver.throttle_channel}"
            does = f"sets MANUAL, arms the boat and overrides RC channels {channels}"
        raise ConfigError(
            f"{hardware}: {UNARMED}. Driving {does}. Write arm: true into the file, or give --arm, "
            "once the propellers are clear."
        )


def _check_guards(plan: RunPlan, robot: Robot, task: Task) -> None:
    """Refuse an area of the other space, a fallback that has nothing for the pair, and estimators of other robots."""
    check_area_of(robot, plan.guards.area)
    if plan.guards.guard:
        check_guard(robot, plan.guards.area)
    if plan.guards.fallback:
        controller_entry(plan.guards.fallback).check(robot, task)
    for file in plan.guards.files:
        check_estimator(file, robot)


def _check_external(plan: RunPlan) -> None:
    """Refuse what no node would carry out, and an adapter where a controller of ours commands."""
    external, adapter, topic = controller_entry(plan.controller).is_external, plan.adapter, plan.adapter_topic
    if adapter and not external:
        raise ConfigError(
            f"--adapter passes on commands of another node, and '{plan.controller}' commands itself: the plant obeys "
            f"one. Add --controller {EXTERNAL}, or leave --adapter out."
        )
    if topic and not adapter:
        raise ConfigError("--topic is the topic that --adapter takes. Add --adapter, or leave --topic out.")
    if topic and not TOPIC.fullmatch(topic):
        raise ConfigError(
            f"--topic = '{topic}' is no name of a topic; it takes letters, digits, _ and /, such as /cmd_vel_raw."
        )
    if adapter and plan.lockstep:
        raise ConfigError(
            "in lock step each command carries the stamp of the odom that it answers, and commands through --adapter "
            "carry none. Leave --lockstep out; --rate makes a run faster."
        )
    if not external:
        return
    _refuse_own_guards(plan.guards)
    for option, given in (("--copies", plan.copies > 1), ("--controller-in", bool(plan.controller_network))):
        if given:
            raise ConfigError(
                f"{option} is for a controller that Fulmar starts; '{plan.controller}' is yours. Leave it out."
            )


def _refuse_own_guards(guards: Guards) -> None:
    asked = {
        "fallback": guards.fallback is not None,
        "trusted_keys": guards.trusted_keys is not None,
        "max_run_time_s": guards.max_run_time_s > 0.0,
        "area": guards.area != NO_AREA,
        "guard": bool(guards.guard),
    }
    without_effect = [name for name, is_asked in asked.items() if is_asked]
    if without_effect:
        raise ConfigError(
            f"{', '.join(without_effect)}: Fulmar's own controller node carries this out, and with controller "
            f"'{EXTERNAL}' there is none. Leave it out: your node has to do it."
        )


def _check_parts(plan: RunPlan) -> None:
    """Refuse a part of a system that does not start alone."""
    if plan.only and plan.only not in PARTS:
        raise UnknownNameError("part of --only", plan.only, PARTS)
    if plan.only == CONTROLLER and controller_entry(plan.controller).is_external:
        raise ConfigError(
            "the controller of this system is external, and you start it. Use --only plant or another --controller."
        )
    if plan.only == CONTROLLER and plan.recording_mode:
        raise ConfigError("the recorder runs beside the plant: --recording goes with --only plant.")


def _check_recording(plan: RunPlan, task: Task) -> None:
    """Refuse several bags where there is one goal or no end of them, and a folder that cannot take a bag."""
    if plan.recording.mode == "goals" and not plan.standing:
        raise ConfigError("a run has one bag: --recording goals is for `fulmar up`. Leave it out.")
    if plan.recording.mode == "goals" and task.goal_topic == "goal_velocity":
        raise ConfigError(
            f"velocities stream: task '{task.name}' gets no bag for each goal. Use --recording whole or ring."
        )
    if not plan.record:
        return
    record = Path(plan.record)
    if record.exists():
        raise ConfigError(
            f"{record} exists already; nothing recorded is overwritten. Give --record another folder."
        )
    there = next(folder for folder in record.absolute().parents if folder.exists())
    if there.is_dir() and not os.access(there, os.W_OK | os.X_OK):
        raise ConfigError(
            f"{record}: cannot write a bag in {there}: Permission denied. Name a folder that you may write."
        )


def _check_distance(plan: RunPlan, robot: Robot, task: Task) -> None:
    """Raise ConfigError for a start beyond the geofence around the first target, or targets as far from each other."""
    if task.goal_topic == "goal_velocity" or plan.mission is None:
        return
    axes = task.state_type.AXES
    places = [np.asarray(plan.start[:axes]), *plan.mission.targets[:, :axes]]
    for number, (here, there) in enumerate(itertools.pairwise(places)):
        distance = math.dist(here, there)
        if distance > robot.limits.geofence:
            what = f"targets {number} and {number + 1}" if number else "start and goal"
            raise ConfigError(
                f"{what} are {distance:.1f} m apart, the geofence of '{robot.name}' is "
                f"{robot.limits.geofence:g} m. Bring them nearer to each other."
            )


def checked_rate(robot: Robot, control_hz: float) -> float:
    """The rate itself; raises ConfigError where the control period is no multiple of the physics step."""
    try:
        robot.timing.substeps(control_hz)
    except ValueError as error:
        raise ConfigError(f"robot '{robot.name}': {error}") from error
    return control_hz


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


def check_signed(folder: Path, trusted: Path, *, fallback: str | None) -> None:
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


def read_remappings(texts: Sequence[str]) -> dict[str, str]:
    """New topic names by the wires' own, from texts `FROM:=TO`; TO without leading slash is in the robot's namespace.

    Raises:
        ConfigError: Not of this form, no topic that may be renamed, no name of a topic, or two topics of one name.
    """
    found: dict[str, str] = {}
    for text in texts:
        wire, separator, name = text.partition(":=")
        if not separator or not wire or not name:
            raise ConfigError(
                f"--remap {text} must be FROM:=TO, such as {MOCAP.name}:=/vrpn_mocap/body/pose."
            )
        if wire not in REMAPPABLE:
            raise UnknownNameError("topic to remap", wire, REMAPPABLE)
        if wire in found:
            raise ConfigError(f"--remap gives '{wire}' two names: {found[wire]} and {name}. Leave one out.")
        if not TOPIC.fullmatch(name):
            raise ConfigError(
                f"--remap {text}: '{name}' is no name of a topic; it takes letters, digits, _ and /, such as "
                "/vrpn_mocap/body/pose."
            )
        found[wire] = name
    taken = [found.get(wire, wire) for wire in REMAPPABLE]
    twice = [name for name in taken if taken.count(name) > 1]
    if twice:
        raise ConfigError(f"--remap gives two topics the name '{twice[0]}'. Give each a name of its own.")
    return found


def adapter_path(robot: str, asked: str) -> str:
    """Path of an adapter's hardware file, by a name of `configs/hardware` or a path; empty where none is asked for.

    Raises:
        ConfigError: There is no such file, it is another robot's, or its driver speaks no topic.
    """
    if not asked:
        return ""
    path = default_hardware(robot, asked)
    driver = load_hardware(path).driver
    if not isinstance(driver, TOPIC_DRIVERS):
        known = [name for name in config_names("hardware") if _is_topic_of(name, robot)]
        raise ConfigError(
            f"--adapter {asked}: driver '{driver.kind}' takes no topic. Files of '{robot}' whose driver does: "
            f"{', '.join(known) or 'none'}."
        )
    return path


def _is_topic_of(name: str, robot: str) -> bool:
    file = load_hardware(name)
    return file.robot == robot and isinstance(file.driver, TOPIC_DRIVERS)
