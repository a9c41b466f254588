"""Checks of what a run is asked for, before any process is started."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from fulmar_bringup.emulation import check_emulated
from fulmar_bringup.system import (
    Guards,
    default_hardware,
)
from fulmar_core.config.errors import BundleError, ConfigError, UnknownNameError
from fulmar_core.config.own_class import is_own
from fulmar_core.config.paths import config_names
from fulmar_core.controllers.classical import has_law
from fulmar_core.estimators.kinds import check_estimator, default_estimator, estimator_kind
from fulmar_core.loop.bundle_signature import verify_bundle
from fulmar_core.loop.controller_settings import POLICY
from fulmar_core.loop.policy_bundle import check_fit, check_folder, read_bundle, read_passport
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.topics import COMMAND, MOCAP, ODOMETRY, SENSOR_WIRES, TRUTH, VELOCITY_COMMAND
from fulmar_core.safety.geofence import NO_AREA, check_area_of
from fulmar_core.safety.watchdog import default_timeout
from fulmar_core.tasks import Task
from fulmar_core.tasks.goal import Goal, PoseTuple
from fulmar_core.worlds.scenario import Scenario
from hardware_drivers.hardware import TOPIC_DRIVERS, load_hardware
from hardware_drivers.own_driver import check_own_driver
from hardware_drivers.settings import UNARMED, MavlinkBoat
from policy_server.controllers import EXTERNAL, FALLBACKS, controller_entry, shipped_policies, shipped_policy

# Topics between plant, controller and estimator. Goals, e-stop and status keep their names: the run itself and every
# other command of `fulmar` use them.
REMAPPABLE = tuple(wire.name for wire in (MOCAP, *SENSOR_WIRES.values(), TRUTH, COMMAND, VELOCITY_COMMAND))
EVENT_RATE = "event_rate"  # file of configs/estimators that takes the place of a dead gyroscope
TOPIC = re.compile(r"/?[A-Za-z][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*")


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


def check_external(
    controller: str, guards: Guards, *, adapter: str | None, topic: str | None, lockstep: bool
) -> None:
    """Refuse guards that no node would carry out, and an adapter where a controller of ours commands.

    Raises:
        ConfigError: On the first thing that would have no effect, or that cannot work.
    """
    external = controller_entry(controller).is_external
    if adapter and not external:
        raise ConfigError(
            f"--adapter passes on commands of another node, and '{controller}' commands itself: the plant obeys one. "
            f"Add --controller {EXTERNAL}, or leave --adapter out."
        )
    if topic and not adapter:
        raise ConfigError("--topic is the topic that --adapter takes. Add --adapter, or leave --topic out.")
    if topic and not TOPIC.fullmatch(topic):
        raise ConfigError(
            f"--topic = '{topic}' is no name of a topic; it takes letters, digits, _ and /, such as /cmd_vel_raw."
        )
    if adapter and lockstep:
        raise ConfigError(
            "in lock step each command carries the stamp of the odom that it answers, and commands through --adapter "
            "carry none. Leave --lockstep out; --rate makes a run faster."
        )
    if external:
        _check_guards(guards)


def _check_guards(guards: Guards) -> None:
    asked = {
        "fallback": guards.fallback is not None,
        "trusted_keys": guards.trusted_keys is not None,
        "max_run_time_s": guards.max_run_time_s > 0.0,
        "area": guards.area != NO_AREA,
    }
    without_effect = [name for name, is_asked in asked.items() if is_asked]
    if without_effect:
        raise ConfigError(
            f"{', '.join(without_effect)}: Fulmar's own controller node carries this out, and with controller "
            f"'{EXTERNAL}' there is none. Leave it out: your node has to do it."
        )


def adapter_path(robot: str, asked: str | None) -> str:
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


def checked_hardware(robot: str, backend: str, asked: str | None, *, emulate: bool, hurried: bool) -> str:
    """Path of the hardware file, empty for simulators.

    Raises:
        ConfigError: The options do not go together, or the file is wrong.
    """
    if backend != "hardware":
        if asked is not None or emulate:
            raise ConfigError(f"--hardware and --emulate go with --backend hardware, not with {backend}.")
        return ""
    if hurried:
        raise ConfigError("a device runs in real time: --backend hardware takes no --lockstep and no --rate.")
    path = default_hardware(robot, asked)
    driver = load_hardware(path).driver
    if emulate:
        check_emulated(driver)
    check_own_driver(driver)
    return path


def check_node_options(controller: str, *, copies: int, network: str) -> None:
    """Raise ConfigError for options of the controller node where an external controller runs."""
    for option, given in (("--copies", copies > 1), ("--controller-in", bool(network))):
        if given and controller_entry(controller).is_external:
            raise ConfigError(
                f"{option} is for a controller that Fulmar starts; '{controller}' is yours. Leave it out."
            )


def check_arming(hardware: str, *, arm: bool) -> None:
    """Raise ConfigError for a boat that may not arm, and for `--arm` where nothing is armed.

    The hardware file is empty for simulators.
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


def checked_mocap(mocap_hz: float, hardware: str, *, emulate: bool, lockstep: bool, estimated: bool) -> float:
    """The rate itself, where something simulates a motion capture.

    Raises:
        ConfigError: The robot is real, or in lock step nothing takes the poses.
    """
    if mocap_hz and hardware and not emulate:
        raise ConfigError("--mocap-hz simulates a motion capture; a real robot has its own. Leave it out.")
    if mocap_hz and lockstep and not estimated:
        raise ConfigError(
            "in lock step the plant publishes poses for an estimator only. Add --estimator, or leave --lockstep out; "
            "--rate makes a run faster."
        )
    return mocap_hz


def checked_guards(usual: Guards, asked: Mapping[str, Any], robot: Robot, task: Task) -> Guards:
    """The usual guards with what was asked for, if they can do what they are for.

    Raises:
        ConfigError: A fallback that has nothing for the pair, no such estimator, or an area of the other space.
    """
    fallback = asked.get("fallback")
    if fallback is not None and fallback not in FALLBACKS:
        raise UnknownNameError("fallback", fallback, FALLBACKS)
    guards = replace(usual, **_split_estimators(asked))
    check_area_of(robot, guards.area)
    if guards.fallback:
        controller_entry(guards.fallback).check(robot, task)
    for file in guards.files:
        check_estimator(file, robot)
    return guards


def _split_estimators(asked: Mapping[str, Any]) -> dict[str, Any]:
    """The same with several files of estimators, separated by commas, split: the one of odometry, and the rest."""
    files = [file.strip() for file in str(asked.get("estimator") or "").split(",") if file.strip()]
    rest = tuple(file for file in files if ODOMETRY not in estimator_kind(file).publishes)
    first = [file for file in files if file not in rest]
    if len(first) > 1:
        raise ConfigError(
            f"{' and '.join(first)} estimate the odometry, and a controller follows one. Leave one out."
        )
    found = {key: value for key, value in asked.items() if key != "estimator"}
    return found | ({"estimator": first[0]} if first else {}) | ({"estimators": rest} if rest else {})


def usual_controller(controller: str, policy: Path | None, robot: Robot, task: Task) -> str:
    """The controller that was asked for, or another one in the place of a policy that a satellite or aircraft lacks."""
    wanted = controller == POLICY and policy is None and robot.kind.usual_law
    return robot.kind.usual_law if wanted and shipped_policy(robot.name, task.name) is None else controller


def with_usual_estimators(guards: Guards, robot: Robot, scenario: Scenario, backend: str) -> Guards:
    """The guards of a simulated satellite, whose attitude is estimated, and whose rate too where its gyroscope dies."""
    if not robot.kind.always_estimated or backend == "hardware":
        return guards
    if guards.estimator is None:
        guards = replace(guards, estimator=default_estimator(robot))
    lost = scenario.sensing.gyroscope_dies_s is not None
    if (
        lost
        and robot.event_cameras
        and not any(estimator_kind(file).takes.get("events") for file in guards.estimators)
    ):
        guards = replace(guards, estimators=(*guards.estimators, EVENT_RATE))
    return guards


def check_distance(robot: Robot, task: Task, mission: Goal, start: PoseTuple) -> None:
    """Raise ConfigError for a start beyond the geofence around the first target, or targets as far from each other."""
    if task.goal_topic == "goal_velocity":
        return
    axes = task.state_type.AXES
    places = [np.asarray(start[:axes]), *mission.targets[:, :axes]]
    for number, (here, there) in enumerate(itertools.pairwise(places)):
        distance = math.dist(here, there)
        if distance > robot.limits.geofence:
            what = f"targets {number} and {number + 1}" if number else "start and goal"
            raise ConfigError(
                f"{what} are {distance:.1f} m apart, the geofence of '{robot.name}' is "
                f"{robot.limits.geofence:g} m. Bring them nearer to each other."
            )


def check_finite(**values: PoseTuple | float | None) -> None:
    """Refuse a value that is not finite; the values by what they are called."""
    for name, value in values.items():
        if value is not None and not np.isfinite(value).all():
            raise ConfigError(f"{name} = {value} must be finite.")


def checked_rate(robot: Robot, control_hz: float) -> float:
    """The rate itself; raises ConfigError where the control period is no multiple of the physics step."""
    try:
        robot.timing.substeps(control_hz)
    except ValueError as error:
        raise ConfigError(f"robot '{robot.name}': {error}") from error
    return control_hz


def check_beat(control_hz: float, rate: float) -> None:
    """Raise ConfigError where the watchdog would trip between any two commands, in real time.

    Args:
        control_hz: Command rate, in simulated time [Hz].
        rate: Simulated seconds a wall-clock second.
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
