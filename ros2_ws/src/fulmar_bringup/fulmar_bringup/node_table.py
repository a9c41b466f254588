"""The table of processes: each node that a system may have, with its parameters, inputs and outputs; starts nothing."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

from fulmar_bringup.emulation import Emulation
from fulmar_bringup.estimator_rows import estimator_specs, robot_row, simulates_without_noise
from fulmar_bringup.run_plan import NodeSpec, Parameter, RunPlan
from fulmar_core.config.recording import Recording
from fulmar_core.estimators.kinds import estimator_kind, load_estimator
from fulmar_core.robots.actuators.refuge import LANDS_S
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import (
    ACTION,
    ACTUATORS_STATE,
    ANSWER,
    CLOCK,
    DESCRIPTION,
    DEVICE_STATE,
    ESTOP,
    METADATA,
    MOCAP,
    OBSERVATION,
    OBSTACLES,
    ODOMETRY,
    PERIOD,
    STATIC_TRANSFORMS,
    STATUS,
    TRANSFORMS,
    TRUTH,
    WIRES,
    Wire,
    command_wire,
    goal_wires,
    own_wires,
)
from fulmar_core.safety.geofence import NO_AREA
from fulmar_core.tasks import load_task
from hardware_drivers.hardware import load_hardware
from policy_server.controllers import controller_entry

STOPS_S = 4.0  # for a plant to end once its robot is down [s]
MODEL = (
    DESCRIPTION.name,
    TRANSFORMS.name,
    STATIC_TRANSFORMS.name,
)  # of every plant; the last two need tf2_msgs


def controller_spec(plan: RunPlan) -> NodeSpec:
    """The node that controls."""
    robot, task = load_robot(plan.robot), load_task(plan.task)
    parameters: dict[str, Parameter] = {
        "controller": plan.controller,
        "robot": plan.robot,
        "task": plan.task,
        "control_hz": plan.control_hz,
        "lockstep": plan.lockstep,
        "rate": plan.rate,
        "goals_streamed": bool(plan.goals),
    }
    if plan.excitation:
        parameters["excitation"] = plan.excitation
    if controller_entry(plan.controller).draws:
        parameters["seed"] = plan.seed
    guards = plan.guards
    if controller_entry(plan.controller).runs_bundle:
        texts = {
            "policy": plan.policy,
            "fallback": guards.fallback or "",
            "trusted_keys": "" if guards.trusted_keys is None else str(Path(guards.trusted_keys).absolute()),
        }
        parameters |= {key: text for key, text in texts.items() if text}
    if guards.max_run_time_s:
        parameters["max_run_time_s"] = guards.max_run_time_s
    if guards.area != NO_AREA:
        parameters["area"] = list(guards.area)
    if guards.estop:
        parameters["estop"] = True
    if plan.unattended:
        parameters["unattended"] = True
    if plan.backend == "hardware":
        hardware = load_hardware(plan.hardware)
        if hardware.has_bearing:
            parameters["air_bearing"] = True
        # Encoders of a base at rest repeat; motion capture never does.
        repeats = not estimates_odometry(plan) and not hardware.seen_from_outside
    else:
        repeats = simulates_without_noise(plan)
    if repeats:
        parameters["odometry_may_repeat"] = True
    if plan.copies > 1:
        parameters["copies"] = plan.copies
    return robot_row(
        plan,
        "controller",
        "policy_server.controller_node",
        parameters,
        network=plan.controller_network,
        inputs=(
            ODOMETRY.name,
            *(wire.name for wire in goal_wires(task.goal_topic)),
            *((OBSTACLES.name,) if task.sees_obstacles else ()),
            *(thing.wire.name for thing in task.things),
        ),
        outputs=(command_wire(robot).name, STATUS.name, METADATA.name, OBSERVATION.name, ACTION.name),
    )


def adapter_spec(plan: RunPlan) -> NodeSpec:
    """The node that passes the commands of another stack on to the plant."""
    parameters: dict[str, Parameter] = {"hardware": plan.adapter}
    if plan.adapter_topic:
        parameters["topic"] = plan.adapter_topic
    return robot_row(
        plan,
        "adapter",
        "hardware_drivers.adapter_node",
        parameters,
        outputs=(command_wire(load_robot(plan.robot)).name,),
    )


def commander_specs(plan: RunPlan) -> tuple[NodeSpec, ...]:
    """The node that commands the plant; none where an external controller does so without an adapter."""
    if not controller_entry(plan.controller).is_external:
        return (controller_spec(plan),)
    return (adapter_spec(plan),) if plan.adapter else ()


def estimates_odometry(plan: RunPlan) -> bool:
    """Whether a node between plant and controller publishes the odometry, in the place of the plant."""
    estimator = plan.guards.estimator
    if estimator and ODOMETRY in estimator_kind(estimator).publishes:
        return True
    return any(ODOMETRY.name in node.outputs for node in plan.nodes)


def takes_poses(plan: RunPlan) -> bool:
    """Whether what estimates the odometry takes poses of motion capture; a satellite's takes a star tracker."""
    estimator = plan.guards.estimator
    return not estimator or MOCAP in estimator_kind(estimator).readings.values()


def chain_of(plan: RunPlan) -> tuple[str, ...]:
    """Nodes between plant and controller that answer each period of lock step; none by the clock."""
    if not plan.lockstep:
        return ()
    own = (node.name for node in plan.nodes if PERIOD.name in node.inputs)
    return (*(row.name for row in estimator_specs(plan)), *own)


def paced_wire(plan: RunPlan) -> Wire:
    """The measurement whose subscribers a plant waits for.

    Odometry, poses in its place, or what the actuators do; in lock step with nodes between, the periods.
    """
    estimated = estimates_odometry(plan)
    if chain_of(plan):
        return PERIOD
    if plan.hardware and (estimated or not load_hardware(plan.hardware).measures_odometry):
        return ACTUATORS_STATE
    if estimated and not takes_poses(plan):
        return ACTUATORS_STATE
    return MOCAP if estimated else ODOMETRY


def plant_spec(plan: RunPlan, *, port: str = "") -> NodeSpec:
    """The node that simulates, or that drives a device.

    Args:
        plan: What to run.
        port: Where the device is, in the place of what the hardware file says.
    """
    lands_s = LANDS_S + STOPS_S if load_robot(plan.robot).flies and not plan.lockstep else 0.0
    parameters: dict[str, Parameter] = {
        "robot": plan.robot,
        "task": plan.task,
        "backend": plan.backend,
        "scenario": plan.scenario,
        "seed": plan.seed,
        "start": list(plan.start),
        "control_hz": plan.control_hz,
        "lockstep": plan.lockstep,
        "rate": plan.rate,
        "duration_s": plan.duration_s,
        "autostart": not plan.supervised,
    }
    if plan.guards.estop:
        parameters["estop"] = True
    estimated, chain = estimates_odometry(plan), chain_of(plan)
    captured = estimated and takes_poses(plan)
    if estimated:
        parameters["estimated"] = True
        if not captured:
            parameters["captured"] = False
    if any(TRUTH.name in node.inputs for node in (*plan.nodes, *estimator_specs(plan))):
        parameters["truth_in_period"] = True
    if chain:
        parameters["chain"] = list(chain)
    if plan.backend == "hardware":
        parameters["hardware"] = plan.hardware
        if plan.arm:
            parameters["arm"] = True
        if plan.unattended:
            parameters["unattended"] = True
        if port:
            parameters["port"] = port
        return robot_row(
            plan,
            "plant",
            "hardware_drivers.driver_node",
            parameters,
            inputs=(command_wire(load_robot(plan.robot)).name,),
            outputs=tuple(
                dict.fromkeys((ACTUATORS_STATE.name, *_sensor_topics(plan), paced_wire(plan).name, *MODEL))
            ),
            ends_within_s=lands_s,
        )
    parameters |= _motion_capture(plan)
    things = tuple(thing.wire.name for thing in load_task(plan.task).things)
    poses = (MOCAP.name,) if captured or plan.mocap_hz else ()
    odometry = () if estimated else (ODOMETRY.name,)
    period = (PERIOD.name,) if chain else ()
    return robot_row(
        plan,
        "plant",
        "sim_nodes.sim_node",
        parameters,
        inputs=(command_wire(load_robot(plan.robot)).name, *((ANSWER.name,) if chain else ())),
        outputs=(
            CLOCK.name,
            TRUTH.name,
            ACTUATORS_STATE.name,
            *_sensor_topics(plan),
            *odometry,
            *poses,
            *things,
            *period,
            *MODEL,
        ),
        ends_within_s=lands_s,
    )


def _sensor_topics(plan: RunPlan) -> tuple[str, ...]:
    """Topics of a robot's sensors but the odometry, which may come from another node."""
    return tuple(
        kind.wire.name for kind in load_robot(plan.robot).sensors.kinds.values() if kind.wire != ODOMETRY
    )


def _motion_capture(plan: RunPlan) -> dict[str, Parameter]:
    """Parameters of the simulated motion capture."""
    late: dict[str, Parameter] = {}
    if plan.guards.estimator:
        late["mocap_late_s"] = load_estimator(plan.guards.estimator).latency_s
    return late | ({"mocap_hz": plan.mocap_hz} if plan.mocap_hz else {})


def emulator_spec(plan: RunPlan, emulation: Emulation) -> NodeSpec:
    """The node that stands in for a device."""
    parameters: dict[str, Parameter] = {
        "robot": plan.robot,
        "task": plan.task,
        "scenario": plan.scenario,
        "seed": plan.seed,
        "start": list(plan.start),
        "device": emulation.device,
        "link": emulation.link,
        **emulation.more,
    }
    parameters |= _motion_capture(plan)
    return robot_row(
        plan,
        "emulator",
        "sim_nodes.emulator_node",
        parameters,
        outputs=(DEVICE_STATE.name, MOCAP.name),
    )


def recorder_spec(plan: RunPlan, *, directory: str = "", info: str = "", files: str = "") -> NodeSpec:
    """The node that records.

    Args:
        plan: What to run.
        directory: The bag folder; empty: the node makes one under `runs/`.
        info: As `bag_origin.run_info` gives it.
        files: As `bag_origin.attachments` gives it.
    """
    texts = {"directory": directory, "run_info": info, "attachments": files}
    things, own = load_task(plan.task).things, own_wires(load_robot(plan.robot))
    usual = asdict(Recording())
    unusual = {key: value for key, value in asdict(plan.recording).items() if value != usual[key]}
    return robot_row(
        plan,
        "recorder",
        "fulmar_ros.recorder_node",
        {key: text for key, text in texts.items() if text}
        | unusual
        | ({"lossless": True} if chain_of(plan) else {})
        | ({"things": [thing.name for thing in things]} if things else {})
        | ({"own_topics": [f"{wire.name} {wire.type}" for wire in own]} if own else {}),
        observed=tuple(
            wire.name for wire in (*WIRES, *own, *(thing.wire for thing in things)) if wire.recorded
        ),
        loss=plan.loss_of_helpers,
    )


def guard_specs(plan: RunPlan) -> tuple[NodeSpec, ...]:
    """The nodes that a plan's guards ask for."""
    nodes = []
    if plan.guards.estop:
        nodes.append(
            robot_row(
                plan,
                "estop",
                "fulmar_ros.estop_node",
                {"robot": plan.robot} | ({"pressed": True} if plan.unattended else {}),
                outputs=(ESTOP.name,),
                loss=plan.loss_of_helpers,
            )
        )
    return (*nodes, *estimator_specs(plan))
