"""Row of the node that controls."""

from __future__ import annotations

from pathlib import Path

from fulmar_bringup.estimator_row import simulates_without_noise
from fulmar_bringup.lockstep_chain import estimates_odometry
from fulmar_bringup.node_row import NodeRow, robot_spec
from fulmar_bringup.node_spec import CONTROLLER, NodeSpec, Parameter, given
from fulmar_bringup.run_plan import RunPlan
from fulmar_core.loop.envelope import watches_envelope
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import (
    ACTION,
    ENVELOPE_STATE,
    METADATA,
    OBSERVATION,
    OBSTACLES,
    ODOMETRY,
    STATUS,
    command_wire,
    goal_wires,
)
from fulmar_core.safety.geofence import NO_AREA
from fulmar_core.tasks import load_task
from hardware_drivers.hardware import load_hardware
from policy_server.controllers import controller_entry


def controller_spec(plan: RunPlan) -> NodeSpec:
    """The node that controls."""
    robot, task = load_robot(plan.robot), load_task(plan.task, plan.thing)
    parameters: dict[str, Parameter] = {
        "controller": plan.controller,
        "robot": plan.robot,
        "task": plan.task,
        "control_hz": plan.control_hz,
        "lockstep": plan.lockstep,
        "rate": plan.rate,
        "goals_streamed": bool(plan.goals),
    }
    guards, entry = plan.guards, controller_entry(plan.controller)
    # Seed and keys also for controllers that take over on request.
    keys = "" if guards.trusted_keys is None else str(Path(guards.trusted_keys).absolute())
    parameters |= given(seed=plan.seed, trusted_keys=keys)
    if entry.runs_bundle:
        parameters |= given(policy=plan.policy, fallback=guards.fallback)
    hardware = load_hardware(plan.hardware) if plan.backend == "hardware" else None
    # Encoders of a base at rest repeat; motion capture never does.
    encoded = hardware is not None and not (estimates_odometry(plan) or hardware.seen_from_outside)
    parameters |= given(
        thing=plan.thing,
        excitation=plan.excitation,
        max_run_time_s=guards.max_run_time_s,
        area=list(guards.area) if guards.area != NO_AREA else None,
        guard=guards.guard,
        estop=guards.estop,
        unattended=plan.unattended,
        air_bearing=hardware is not None and hardware.has_bearing,
        odometry_may_repeat=encoded or simulates_without_noise(plan),
        copies=plan.copies if plan.copies > 1 else 0,
    )
    return robot_spec(
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
        outputs=(
            command_wire(robot).name,
            *(wire.name for wire in (STATUS, METADATA, OBSERVATION, ACTION)),
            *((ENVELOPE_STATE.name,) if watches_envelope(robot, guards.guard, guards.area) else ()),
        ),
    )


ROW = NodeRow(  # none where a node that Fulmar does not start controls
    lambda plan, _: () if controller_entry(plan.controller).is_external else (controller_spec(plan),),
    ("controller",),
    part=CONTROLLER,
)
