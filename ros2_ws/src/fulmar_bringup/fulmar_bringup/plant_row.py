"""Row of the node that simulates, or that drives a device."""

from __future__ import annotations

from fulmar_bringup.lockstep_chain import between, chain_of, estimates_odometry, paced_wire, takes_poses
from fulmar_bringup.node_row import Launcher, NodeRow, robot_spec
from fulmar_bringup.node_spec import NodeSpec, Parameter, given
from fulmar_bringup.run_plan import ORIGIN, RunPlan
from fulmar_core.estimators.kinds import load_estimator
from fulmar_core.robots.actuators.refuge import LANDS_S
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import (
    ACTUATORS_STATE,
    ANSWER,
    CLOCK,
    DESCRIPTION,
    MOCAP,
    ODOMETRY,
    PERIOD,
    ROBOT_INFO,
    STATIC_TRANSFORMS,
    TRANSFORMS,
    TRUTH,
    command_wire,
)
from fulmar_core.robots.topics import ORIGIN as ORIGIN_WIRE
from fulmar_core.safety.geofence import NO_AREA
from fulmar_core.tasks import load_task
from policy_server.controllers import controller_entry, shipped_policy

STOPS_S = 4.0  # for a plant to end once its robot is down [s]
# Of every plant; the last two need tf2_msgs.
MODEL = (DESCRIPTION.name, ROBOT_INFO.name, ORIGIN_WIRE.name, TRANSFORMS.name, STATIC_TRANSFORMS.name)


def plant_spec(plan: RunPlan, *, port: str = "") -> NodeSpec:
    """The node that simulates, or that drives a device.

    Args:
        plan: What to run.
        port: Where the device is, in the place of what the hardware file says.
    """
    lands_s = LANDS_S + STOPS_S if not load_robot(plan.robot).kind.rests and not plan.lockstep else 0.0
    parameters: dict[str, Parameter] = {
        "robot": plan.robot,
        "task": plan.task,
        "backend": plan.backend,
        "scenario": plan.scenario,
        "seed": plan.seed,
        "start": list(plan.start or ORIGIN),
        "control_hz": plan.control_hz,
        "lockstep": plan.lockstep,
        "rate": plan.rate,
        "duration_s": plan.duration_s,
        "autostart": not plan.supervised,
    }
    estimated, chain = estimates_odometry(plan), chain_of(plan)
    captured = estimated and takes_poses(plan)
    parameters |= given(
        thing=plan.thing,
        estop=plan.guards.estop,
        estimated=estimated,
        **system_facts(plan),
        truth_in_period=bool(chain)
        and any(TRUTH.name in node.inputs for node in (*plan.nodes, *between(plan))),
        chain=list(chain),
    )
    if estimated and not captured:
        parameters["captured"] = False
    commands, things = command_wire(load_robot(plan.robot)).name, load_task(plan.task, plan.thing).things
    sensed = (ACTUATORS_STATE.name, *_sensor_topics(plan))
    if plan.backend == "hardware":
        module, inputs = "hardware_drivers.driver_node", (commands,)
        outputs = tuple(dict.fromkeys((*sensed, paced_wire(plan).name, *MODEL)))
        parameters |= given(hardware=plan.hardware, arm=plan.arm, unattended=plan.unattended, port=port)
    else:
        module, inputs = "sim_nodes.sim_node", (commands, *((ANSWER.name,) if chain else ()))
        odometry = () if estimated else (ODOMETRY.name,)
        poses = (MOCAP.name,) if captured or plan.mocap_hz else ()
        seen = (*odometry, *poses, *(thing.wire.name for thing in things))
        outputs = (CLOCK.name, TRUTH.name, *sensed, *seen, *((PERIOD.name,) if chain else ()), *MODEL)
        parameters |= motion_capture(plan)
    return robot_spec(
        plan, "plant", module, parameters, inputs=inputs, outputs=outputs, ends_within_s=lands_s
    )


def system_facts(plan: RunPlan) -> dict[str, Parameter | None]:
    """What a plant publishes of its system, as parameters."""
    robot, guards, entry = load_robot(plan.robot), plan.guards, controller_entry(plan.controller)
    return {
        "controller": plan.controller,
        "fallback": guards.fallback if entry.runs_bundle else "",
        "bundle": bool(plan.policy) or shipped_policy(robot.name, plan.task) is not None,
        "emulated": plan.emulated,
        "origin": list(plan.origin) or None,
        "area": list(guards.area) if guards.area != NO_AREA else None,
    }


def _sensor_topics(plan: RunPlan) -> tuple[str, ...]:
    """Topics of a robot's sensors but the odometry, which may come from another node."""
    return tuple(
        kind.wire.name for kind in load_robot(plan.robot).sensors.kinds.values() if kind.wire != ODOMETRY
    )


def motion_capture(plan: RunPlan) -> dict[str, Parameter]:
    """Parameters of the simulated motion capture."""
    late: dict[str, Parameter] = {}
    if plan.guards.estimator:
        late["mocap_late_s"] = load_estimator(plan.guards.estimator).latency_s
    return late | ({"mocap_hz": plan.mocap_hz} if plan.mocap_hz else {})


def _specs(plan: RunPlan, launcher: Launcher) -> tuple[NodeSpec, ...]:
    emulated = launcher.emulation.port if launcher.emulation is not None else ""
    return (plant_spec(plan, port=launcher.port or emulated),)


ROW = NodeRow(_specs, ("plant",))
